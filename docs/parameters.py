"""Write docs/parameters.md: what `antennate parameters` prints, less what docs/options.md has."""

from generated import finish

from antennate.cli.parameters import page

if __name__ == "__main__":
    finish(
        __file__,
        page(beside_commands=True),
        source="`packages/antennate/src/antennate/params/` and `robots/`",
    )
