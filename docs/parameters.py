"""Write docs/parameters.md: what `antennate parameters` prints."""

from generated import finish

from antennate.cli.parameters import page

if __name__ == "__main__":
    finish(__file__, page(), source="`src/antennate/params/` and `robots/`")
