"""What of a change of the library's surface breaks users: two lists of `tests/surface --write` compared."""

import re


def parsed(text: str) -> dict[str, tuple[str, list[str]]]:
    """The blocks of a list by module and name."""
    found, module = {}, ""
    for part in text.strip().split("\n\n")[1:]:
        if part.startswith("# "):
            module = part[2:]
            continue
        line, *members = part.split("\n")
        word = re.sub(r"^(#\[non_exhaustive\] |const (?=fn)|async |unsafe )*", "", line).split(" ")[1]
        found[f"{module}::{re.split('[<(:;]', word)[0]}"] = (line, [member.strip() for member in members])
    return found


def breaks(before: str, now: str) -> list[str]:
    """What of the list before would break its users in the list now. It errs on the side of caution: a changed line breaks.

    >>> def one(text): return "Title.\\n\\n# calibench::robot\\n\\n" + text.replace("; ", "\\n    ")
    >>> def change(before, now): return breaks(one(before), one(now))

    What is new breaks nobody; what has gone, or is written in another way, does:

    >>> change("struct Arm; ..; impl Clone", "struct Arm; axes: usize; ..; fn reach(&self) -> f64; impl Clone; impl Debug")
    []
    >>> change("struct Arm; axes: usize; ..; impl Clone", "struct Arm; axes: u8; ..")
    ['calibench::robot::Arm has lost `axes: usize`', 'calibench::robot::Arm has lost `impl Clone`']
    >>> change("const fn reach() -> f64", "const fn reach() -> f32")
    ['calibench::robot::reach is now `const fn reach() -> f32`; it was `const fn reach() -> f64`']
    >>> change("struct Arm<'a>; impl Clone", "enum Leg; Left")
    ['calibench::robot::Arm is gone']

    Where outsiders write all fields or match all variants, one more breaks them; and so does an item that every implementation of a trait must have:

    >>> change("struct Arm; axes: usize", "struct Arm; axes: usize; links: usize")
    ['calibench::robot::Arm must now have `links: usize`']
    >>> change("enum Axis; X", "enum Axis; X; Y"), change("#[non_exhaustive] enum Axis; X", "#[non_exhaustive] enum Axis; X; Y")
    (['calibench::robot::Axis must now have `Y`'], [])
    >>> change("trait Plant; fn a(&self)", "trait Plant; fn a(&self); fn b(&self); fn c(&self) { .. }")
    ['calibench::robot::Plant must now have `fn b(&self)`']
    """
    new, found = parsed(now), []
    for name, (line, members) in parsed(before).items():
        if name not in new:
            found.append(f"{name} is gone")
            continue
        new_line, new_members = new[name]
        if line != new_line:
            found.append(f"{name} is now `{new_line}`; it was `{line}`")
        found += [f"{name} has lost `{member}`" for member in members if member not in new_members]
        added = [member for member in new_members if member not in members]
        found += [f"{name} must now have `{member}`" for member in added if must_be_known(line, members, member)]
    return found


def must_be_known(line: str, members: list[str], added: str) -> bool:
    """Whether code that knows all members of this name stops compiling when this one is added."""
    if line.startswith("trait "):
        return not added.endswith("{ .. }")
    if re.match(r"(fn|const fn|const|type|impl) ", added) or line.startswith("#[non_exhaustive]"):
        return False
    # A struct with a private field can be made by nobody but the library.
    return line.startswith("enum ") or ".." not in members


def compatible(old: str, new: str) -> bool:
    """Whether `new` promises not to break users of `old`: the first number that is not zero is the same.

    >>> compatible("0.3.0", "0.3.1"), compatible("0.3.0", "0.4.0"), compatible("1.2.0", "1.3.0"), compatible("0.3.0", "1.3.0")
    (True, False, True, False)
    """
    a, b = old.split("."), new.split(".")
    digits = 1 if a[0] != "0" else 2
    return a[:digits] == b[:digits]
