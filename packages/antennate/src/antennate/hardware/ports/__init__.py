"""Ways to send and receive bytes: serial lines, TCP, UDP; found, opened, lost and opened again."""
