# SPDX-License-Identifier: Apache-2.0
"""Writes the man page and the shells' completions of the program, from its --help.

    write_manual.py PROGRAM VERSION DIR      writes shadowdag.1, shadowdag.bash and _shadowdag
"""
import pathlib
import re
import sys

from help_text import commands_of

EXIT_LINE = re.compile(r"^  (\S+(?: \+ n)?) (.*)$")


def roff(text):
    """Returns a text as troff reads it."""
    lines = text.replace("\\", "\\e").replace("-", "\\-").split("\n")
    return "\n".join("\\&" + line if line.startswith((".", "'")) else line for line in lines)


def man_page(commands, version):
    """Returns the man page, in troff's macros of man(7)."""
    main = commands[0]
    # Without a date: what is built twice is the same twice.
    lines = [f'.TH SHADOWDAG 1 "" "ShadowDAG {version}" "User commands"', ".SH NAME",
             "shadowdag \\- " + roff(main.summary[0].lower() + main.summary[1:].rstrip(".")), ".SH SYNOPSIS"]
    lines += [f".B shadowdag\n{roff(command.usage.removeprefix('shadowdag').strip())}\n.br" for command in commands[1:]]
    footer = main.footer.split("\n")[1:]
    statuses = [match.groups() for match in map(EXIT_LINE.match, footer) if match]
    lines += [".SH DESCRIPTION", roff(" ".join(line for line in footer if not EXIT_LINE.match(line)))]
    for command in commands:
        lines += [f".SH {roff(command.name.upper() or 'OPTIONS')}"]
        lines += [roff(command.summary) + "."] if command.name else []
        for heading, options in command.groups:
            lines += [f".SS {roff(heading)}"] if heading != "Options" else []
            for option in options:
                names = ", ".join(f"\\fB{roff(name)}\\fR" for name in option.names)
                value = f"\\fI{roff(option.value)}\\fR" if option.value else ""
                lines += [".TP", " ".join(filter(None, (names, value, "..." if option.is_repeated else ""))),
                          roff(option.help) + (". Required." if option.is_required else "")]
    lines += [".SH EXIT STATUS"]
    for status, meaning in statuses:
        lines += [".TP", f".B {roff(status)}", roff(meaning)]
    return "\n".join(lines) + "\n"


def bash_completion(commands):
    """Returns the completion of bash: by subcommand its options, and by option its choices, files or directories."""
    def words(options):
        return " ".join(name for option in options for name in option.names)
    options = "\n".join(f"        {command.name}) options='{words(command.options)}' ;;" for command in commands[1:])
    values = []
    for command in commands[1:]:
        for option in command.options:
            action = (f"choose '{' '.join(option.choices)}'" if option.choices else
                      "compopt -o dirnames" if option.is_directory else
                      "compopt -o default" if option.is_path else ":" if option.value else "")
            values += [f"        {command.name}:{name}) {action}; return ;;" for name in option.names if action]
    return f"""# Completion of shadowdag for bash; made from its --help.
_shadowdag() {{
    local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD - 1]}} command=${{COMP_WORDS[1]}} options=
    COMPREPLY=()
    choose() {{ mapfile -t COMPREPLY < <(compgen -W "$1" -- "$word"); }}
    if ((COMP_CWORD == 1)); then
        choose '{' '.join(command.name for command in commands[1:])} {words(commands[0].options)}'
        return
    fi
    case $command:$before in
{chr(10).join(values)}
    esac
    case $command in
{options}
    esac
    if [[ $word == -* ]]; then
        choose "$options"
    else
        compopt -o default
    fi
}}
complete -F _shadowdag shadowdag
"""


def zsh_text(text):
    """Returns a text for the inside of a quoted specification of _arguments."""
    return text.replace("\\", "\\\\").replace("'", "'\\''").replace("[", "\\[").replace("]", "\\]").replace(":", "\\:")


def zsh_option(option):
    """Returns the specifications of an option, one for each name, for _arguments."""
    others = f"({' '.join(option.names)})" if not option.is_repeated else "*"
    action = (f"({' '.join(option.choices)})" if option.choices else "_files -/" if option.is_directory else
              "_files" if option.is_path else " ")
    value = f":{zsh_text(option.value)}:{action}" if option.value else ""
    return [f"'{others}{name}[{zsh_text(option.help)}]{value}'" for name in option.names]


def zsh_completion(commands):
    """Returns the completion of zsh, with the help of each option beside it."""
    summaries = "\n".join(f"        '{command.name}:{zsh_text(command.summary)}'" for command in commands[1:])
    cases = []
    for command in commands[1:]:
        specifications = [specification for option in command.options for specification in zsh_option(option)]
        joined = " \\\n                ".join(specifications + ["'*:file:_files'"])
        cases.append(f"        {command.name})\n            _arguments \\\n                {joined} ;;")
    main = " ".join(specification for option in commands[0].options for specification in zsh_option(option))
    return f"""#compdef shadowdag
# Completion of shadowdag for zsh; made from its --help.
_shadowdag() {{
    local -a commands=(
{summaries}
    )
    if ((CURRENT == 2)); then
        _describe command commands
        _arguments {main}
        return
    fi
    local command=$words[2]
    shift words
    ((CURRENT--))
    case $command in
{chr(10).join(cases)}
    esac
}}
_shadowdag "$@"
"""


def write(program, version, directory):
    commands = commands_of(program)
    folder = pathlib.Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("shadowdag.1", man_page(commands, version)), ("shadowdag.bash", bash_completion(commands)),
                       ("_shadowdag", zsh_completion(commands))):
        (folder / name).write_text(text)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    write(*sys.argv[1:])
