#!/usr/bin/env python3
"""Man pages and bash completion from the command line itself: cli_pages.py TREE VERSION CHANGELOG MAN_FOLDER COMPLETION

TREE is what `axlecast --cli-tree` prints (tools/axlecast/cli_tree.h). The pages carry the date of the newest entry of the
Debian CHANGELOG, so that two builds of one source are equal.
"""

import email.utils
import json
import pathlib
import re
import sys

from roff import Page, escaped


def option_names(option):
    value = option.get("value", "")
    if value == "TEXT" and not option["names"][0].startswith("-"):
        value = ""  # the name of an argument suffices
    names = ", ".join(rf"\fB{escaped(name)}\fR" for name in option["names"])
    return names + (rf" \fI{escaped(value)}\fR" if value else "")


def notes(option):
    """What the parser checks, in words."""
    said = []
    if "choices" in option:
        said.append("one of " + ", ".join(option["choices"]))
    if "limits" in option:
        said.append(option["limits"])
    if "default" in option:
        said.append("default " + option["default"])
    if option.get("required"):
        said.append("required")
    if "needs" in option:
        said.append("needs " + ", ".join(option["needs"]))
    if "excludes" in option:
        said.append("not with " + ", ".join(option["excludes"]))
    return f" ({'; '.join(said)})" if said else ""


def synopsis(words, command):
    parts = [rf"\fB{escaped(words)}\fR"]
    for argument in command["arguments"]:
        name = rf"\fI{escaped(argument['names'][0])}\fR"
        if argument.get("most") != 1:
            name += "..."
        parts.append(name if argument.get("required") else f"[{name}]")
    parts.append(r"[\fIOPTIONS\fR]")
    return " ".join(parts)


def sentence(text):
    return text if text.endswith((".", "?", "!", ":")) else text + "."


def footer_parts(footer):
    """A footer's examples as lines, its exit codes and the rest as one paragraph each."""
    examples, codes, rest = [], [], []
    target = rest
    for line in footer.splitlines():
        if re.match(r"examples?:", line):
            target = examples
            line = "  " + line.split(":", 1)[1].strip()
        elif re.match(r"[Ee]xit codes?", line):
            target = codes
        elif target is examples and not line.startswith(" "):
            target = rest
        if line.strip():
            target.append(line[2:] if target is examples else line.strip())
    return examples, " ".join(codes), " ".join(rest)


def describe(page, command):
    """Options, arguments and footer of one command."""
    examples, codes, rest = footer_parts(command.get("footer", ""))
    if rest:
        page.paragraph(sentence(rest))
    for option in command["arguments"] + command["options"]:
        if "--help" in option["names"]:
            continue
        page.item(option_names(option), sentence(option["description"]) + notes(option))
    return examples, [codes] if codes else []


def subcommands(page, words, command):
    examples, codes = [], []
    for child in command["commands"]:
        line = f"{words} {child['name']}"
        page.subsection(line)
        page.raw(synopsis(line, child))
        page.paragraph(sentence(child["description"]))
        more = describe(page, child)
        deeper = subcommands(page, line, child)
        examples += more[0] + deeper[0]
        codes += [code for code in more[1] + deeper[1] if code not in codes]
    return examples, codes


def closing(page, examples, codes, see_also):
    if examples:
        page.section("EXAMPLES")
        page.verbatim(examples)
    if codes:
        page.section("EXIT STATUS")
        for code in codes:
            page.paragraph(sentence(code))
    page.section("SEE ALSO")
    last = len(see_also) - 1
    page.raw("\n".join(rf".BR {escaped(name)} ({section}){',' if index < last else ''}"
                       for index, (name, section) in enumerate(see_also)))


def command_page(command, release, date):
    name = f"axlecast-{command['name']}"
    page = Page(name, 1, command["description"], release, date)
    page.section("SYNOPSIS")
    words = f"axlecast {command['name']}"
    lines = [synopsis(f"{words} {child['name']}", child) for child in command["commands"]]
    page.raw("\n.br\n".join(lines or [synopsis(words, command)]))
    page.section("DESCRIPTION")
    page.paragraph(sentence(command["description"]))
    examples, codes = describe(page, command)
    deeper = subcommands(page, words, command)
    see_also = [("axlecast", 1), ("axlecast.yaml", 5)]
    closing(page, examples + deeper[0], codes + deeper[1], see_also)
    return name, page.text()


def main_page(tree, release, date):
    page = Page(tree["name"], 1, tree["description"].splitlines()[0].rstrip("."), release, date)
    page.section("SYNOPSIS")
    page.raw(r"\fBaxlecast\fR \fICOMMAND\fR [\fIOPTIONS\fR]")
    page.section("DESCRIPTION")
    for line in tree["description"].splitlines():
        page.paragraph(line)
    page.section("COMMANDS")
    for command in tree["commands"]:
        page.item(rf"\fBaxlecast\-{escaped(command['name'])}\fR(1)", sentence(command["description"]))
    page.section("OPTIONS")
    for option in tree["options"]:
        page.item(option_names(option), sentence(option["description"]))
    page.section("ENVIRONMENT")
    page.item(r"\fBAXLECAST_CONFIG\fR", "The machine's file, where none is given.")
    page.section("FILES")
    page.item(r"\fI/etc/axlecast/machine.yaml\fR", "The machine's file, where neither is.")
    closing(page, [], [], [("axlecast.yaml", 5), ("axlecast.units", 7), ("axlecast-bridge", 8)])
    return tree["name"], page.text()


def changelog_date(changelog):
    trailer = re.search(r"^ -- .*>  (.*)$", pathlib.Path(changelog).read_text(), re.MULTILINE).group(1)
    return email.utils.parsedate_to_datetime(trailer).date().isoformat()


def kind(option):
    """Permitted values: words to choose from, or FILE, DEVICE, BUS; empty where only the operator knows."""
    if "choices" in option:
        return " ".join(option["choices"])
    names = {option.get("value", "").upper(), *(name.lstrip("-").upper() for name in option["names"])}
    for known in ("DEVICE", "BUS", "FILE"):
        if known in names:
            return known
    return "FILE" if names & {"CONFIG", "FILES", "LOG", "LOGS", "DIR", "FOLDER", "JOURNAL"} else ""


def completion_cases(tree, path=()):
    """One case of the shell's function for each command, and those of its options' values."""
    key = " ".join(path)
    options = [name for option in tree["options"] for name in option["names"]]
    places = {kind(argument) for argument in tree["arguments"]} - {""}
    yield (f"  '{key}')\n"
           f"    commands='{' '.join(child['name'] for child in tree['commands'])}'\n"
           f"    options='{' '.join(options)}'\n"
           f"    places='{' '.join(sorted(places))}'")
    values = [(name, kind(option)) for option in tree["options"] if "value" in option for name in option["names"]]
    if values:
        yield "    case $2 in\n" + "\n".join(f"      {name}) value='{what or '-'}' ;;" for name, what in values) + \
            "\n    esac"
    yield "    ;;"
    for child in tree["commands"]:
        yield from completion_cases(child, (*path, child["name"]))


COMPLETION = """\
# Completion of axlecast(1) for bash, generated from its command line.

# Sets commands, options, places and value: what may follow the command $1 after the word $2.
_axlecast_grammar() {{
  commands='' options='' places='' value=''
  case $1 in
{cases}
  esac
}}

_axlecast_names() {{
  local given=() i
  for ((i = 1; i + 1 < cword; i++)); do
    [[ ${{words[i]}} == --config ]] && given=(--config "${{words[i + 1]}}")
  done
  axlecast check-config "${{given[@]}}" --list "$1" 2>/dev/null
}}

_axlecast_offer() {{
  local what
  for what in $1; do
    case $what in
    FILE) _filedir ;;
    DEVICE) COMPREPLY+=($(compgen -W "$(_axlecast_names devices)" -- "$cur")) ;;
    BUS) COMPREPLY+=($(compgen -W "$(_axlecast_names buses)" -- "$cur")) ;;
    -) ;;
    *) COMPREPLY+=($(compgen -W "$what" -- "$cur")) ;;
    esac
  done
}}

_axlecast() {{
  local cur prev words cword commands options places value path='' i
  _init_completion || return
  _axlecast_grammar ''
  for ((i = 1; i < cword; i++)); do
    [[ " $commands " == *" ${{words[i]}} "* ]] || continue
    path="${{path:+$path }}${{words[i]}}"
    _axlecast_grammar "$path"
  done
  _axlecast_grammar "$path" "$prev"
  if [[ -n $value ]]; then
    _axlecast_offer "$value"
  elif [[ $cur == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$cur"))
  else
    COMPREPLY=($(compgen -W "$commands" -- "$cur"))
    _axlecast_offer "$places"
  fi
}}

complete -F _axlecast axlecast
"""


def main():
    tree_file, version, changelog, man, completion = sys.argv[1:]
    tree = json.loads(pathlib.Path(tree_file).read_text())
    folder = pathlib.Path(man)
    folder.mkdir(parents=True, exist_ok=True)
    date, release = changelog_date(changelog), f"axlecast {version}"
    for name, text in [main_page(tree, release, date)] + [command_page(command, release, date)
                                                          for command in tree["commands"]]:
        (folder / f"{name}.1").write_text(text)
    pathlib.Path(completion).write_text(COMPLETION.format(cases="\n".join(completion_cases(tree))))


if __name__ == "__main__":
    main()
