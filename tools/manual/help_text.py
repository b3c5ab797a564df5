# SPDX-License-Identifier: Apache-2.0
"""Reads the options of the program from its --help, whose text is made from the one table of options."""
import dataclasses
import re
import subprocess

HELP_COLUMN = 34  # where tools/settings/command_line.cpp lets help begin


@dataclasses.dataclass
class Option:
    """An option, or a positional argument, which has no names."""
    names: list        # ["-o", "--output"]
    value: str         # "F.exr|F.png"; "": a flag
    help: str
    is_required: bool
    is_repeated: bool

    @property
    def choices(self):
        """Returns the words of a value of which one must be chosen; empty if other values are possible."""
        words = self.value.split("|")
        return words if len(words) > 1 and all(re.fullmatch(r"[a-z0-9]+", word) for word in words) else []

    @property
    def is_path(self):
        """Returns whether the value names a file or a directory."""
        return bool(re.match(r"([A-Z]\.[a-z]|F\b|DIR|LIBRARY|SCENE)", self.value))

    @property
    def is_directory(self):
        return self.value.split("|") == ["DIR"]


@dataclasses.dataclass
class Command:
    """The program, whose name is "", or a subcommand."""
    name: str
    summary: str
    usage: str
    groups: list        # [(heading, [Option])]
    footer: str

    @property
    def options(self):
        return [option for _, options in self.groups for option in options if option.names]


def option_of(left, help_text):
    """Returns the option of a line's left column, such as "-o,--output F.png REQUIRED" or "SCENE ..."."""
    words = left.split()
    names = words.pop(0).split(",") if words[0].startswith("-") else []
    marks = {mark for mark in ("REQUIRED", "...") if mark in words}
    value = " ".join(word for word in words if word not in marks)
    return Option(names, value, help_text, "REQUIRED" in marks, "..." in marks)


def parse(name, text):
    """Returns the Command that a text of --help describes. Raises ValueError for lines of another form."""
    blocks = re.split(r"\n(?=\w[\w ]*:\n)", "\n" + text.strip("\n"))
    summary, usage = blocks.pop(0).strip().split("\n", 1)
    command = Command(name, summary, usage.removeprefix("Usage: ").strip(), [], "")
    for block in blocks:
        heading, *lines = block.strip("\n").split("\n")
        if heading == "Exit status:":
            command.footer = block.strip("\n")
            continue
        options, left = [], ""
        for line in filter(str.strip, lines):
            column = line[:HELP_COLUMN].strip() if len(line) > HELP_COLUMN else ""
            if line.startswith(" " * HELP_COLUMN):  # the help of a long left column
                options.append(option_of(left, line.strip()))
                left = ""
            elif left or not line.startswith("  "):
                raise ValueError(f"shadowdag {name} --help: '{line}' is neither an option nor the help of one")
            elif column and line[HELP_COLUMN - 1] == " ":
                options.append(option_of(column, line[HELP_COLUMN:].strip()))
            else:
                left = line.strip()
        command.groups.append((heading.rstrip(":"), options))
    return command


def commands_of(program):
    """Returns the Command of the program itself, then those of its subcommands."""
    def help_of(*words):
        return subprocess.run([program, *words, "--help"], check=True, capture_output=True, text=True).stdout
    main = parse("", help_of())
    # Subcommands have the form of positional arguments: a word, then what it does.
    names = [option.value for heading, options in main.groups if heading == "Subcommands" for option in options]
    main.groups = [group for group in main.groups if group[0] != "Subcommands"]
    return [main] + [parse(name, help_of(name)) for name in names]
