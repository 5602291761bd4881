"""Scripts that let a shell complete commands, flags and values.

`source <(antennate --completion bash)` for now, or keep the output in a file that the shell reads
when it starts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from antennate.cli.arguments import OptionsRequest
from antennate.cli.options import Option
from antennate.errors import BadInputError
from antennate.messages import COMMAND_GROUPS, one_line

SHELLS = ("bash", "zsh", "fish")

_BASH = """\
_antennate() {
    local command=${COMP_WORDS[1]} current=${COMP_WORDS[COMP_CWORD]} flag= i words= parts=
    case "$command" in
%(parts)s
    esac
    if [ "$COMP_CWORD" -gt 2 ]; then
        case " $parts " in
            *" ${COMP_WORDS[2]} "*) command="$command ${COMP_WORDS[2]}"; parts=;;
        esac
    fi
    if [ "$COMP_CWORD" -eq 1 ]; then
        words='%(commands)s'
    else
        for ((i = COMP_CWORD - 1; i > 1; i--)); do
            case ${COMP_WORDS[i]} in --*) flag=${COMP_WORDS[i]}; break;; esac
        done
        case "$command $flag" in
%(values)s
        esac
        case "$current" in -*) words=;; esac
        if [ -z "$words" ]; then
            case "$command" in
%(flags)s
            esac
        fi
        [ "$COMP_CWORD" -ne 2 ] || words="$parts $words"
    fi
    COMPREPLY=($(compgen -W "$words" -- "$current"))
}
complete -o default -F _antennate antennate
"""
_ZSH = "autoload -U +X compinit && compinit\nautoload -U +X bashcompinit && bashcompinit\n"
_HELP = ("--help", "--help-all")
_OWN = ("--help", "--version", "--completion")


def script(
    words: Sequence[str],
    commands: Mapping[str, str],
    carry_out: Callable[[str, Sequence[str]], int],
) -> str:
    """The script for a shell.

    Args:
        words: Name of the shell.
        commands: What each command does, by name.
        carry_out: Runs a command of that name on its words.

    Raises:
        BadInputError: The shell is not one of `SHELLS`.
    """
    if len(words) != 1 or words[0] not in SHELLS:
        found = one_line(" ".join(words)) or "none"
        raise BadInputError(f"--completion: expected one of {', '.join(SHELLS)}, found {found}")
    options = {name: _options(name, carry_out) for name in commands}
    if words[0] == "fish":
        return "".join(f"{line}\n" for line in _fish(commands, options))
    return (_ZSH if words[0] == "zsh" else "") + _bash(options)


def _options(command: str, carry_out: Callable[[str, Sequence[str]], int]) -> Sequence[Option]:
    """The options of a command, which is asked for them in place of a run."""
    try:
        carry_out(command, [OptionsRequest.WORD])
    except OptionsRequest as request:
        return [*request.command.others, *request.command.parameters]
    return ()


def _bash(options: Mapping[str, Sequence[Option]]) -> str:
    values = [
        f"            '{command} {option.flag}') words='{' '.join(_values(option))}';;"
        for command, own in options.items()
        for option in own
        if _values(option)
    ]
    flags = []
    for command, own in options.items():
        every = [option.offered for option in own if not option.positional]
        flags.append(f"                '{command}') words='{' '.join([*every, *_HELP])}';;")
    parts = [
        f"        {name}) parts='{' '.join(names)}';;" for name, names in COMMAND_GROUPS.items()
    ]
    names = " ".join([*dict.fromkeys(name.split()[0] for name in options), *_OWN])
    lines = {"parts": parts, "values": values, "flags": flags}
    return _BASH % {"commands": names, **{name: "\n".join(each) for name, each in lines.items()}}


def _fish(commands: Mapping[str, str], options: Mapping[str, Sequence[Option]]) -> Iterator[str]:
    start = "complete -c antennate -n"
    for name in dict.fromkeys(name.split()[0] for name in commands):
        meaning = commands.get(name, ", ".join(COMMAND_GROUPS.get(name, ())))
        yield f"{start} __fish_use_subcommand -xa {name} -d {_quoted(meaning)}"
    for command, own in options.items():
        group, _, part = command.partition(" ")
        seen = f"__fish_seen_subcommand_from {group}"
        others = " ".join(COMMAND_GROUPS.get(group, ()))
        if part:
            before = f"{seen}; and not __fish_seen_subcommand_from {others}"
            yield f"{start} {_quoted(before)} -xa {part} -d {_quoted(commands[command])}"
            seen += f"; and __fish_seen_subcommand_from {part}"
        elif others:
            seen += f"; and not __fish_seen_subcommand_from {others}"
        for option in own:
            known = _values(option)
            values = f" -xa {_quoted(' '.join(known))}" if known else " -r" * bool(option.metavar)
            if not option.positional:
                name = f"-l {option.offered[2:]}{values}"
                yield f"{start} {_quoted(seen)} {name} -d {_quoted(option.meaning)}"
        for flag in _HELP:
            yield f"{start} {_quoted(seen)} -l {flag[2:]}"


def _values(option: Option) -> list[str]:
    """Known values of an option."""
    return [str(choice) for choice in option.choices] or list(option.examples)


def _quoted(text: str) -> str:
    """A text as one word of fish."""
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
