"""One function per figure: plain data goes in, a figure comes out."""
