"""Signatures of rustdoc's JSON as Rust writes them, with the last name of every path; and names with their members as blocks of lines."""

from dataclasses import dataclass
from typing import Any

Item = dict[str, Any]


def kind(item: Item) -> str:
    return str(next(iter(item["inner"])))


def joined(parts: Any, render: Any = str) -> str:
    return ", ".join(render(part) for part in parts)


def arguments_of(args: Item | None) -> str:
    if not args:
        return ""
    if "parenthesized" in args:
        called: Item = args["parenthesized"]
        return f"({joined(called['inputs'], type_of)}){result_of(called['output'])}"
    inside: Item = args["angle_bracketed"]
    parts = ["_" if arg == "infer" else generic_argument(arg) for arg in inside["args"]]
    for constraint in inside["constraints"]:
        binding = constraint["binding"]
        name = constraint["name"] + arguments_of(constraint["args"])
        parts.append(f"{name} = {term(binding['equality'])}" if "equality" in binding else f"{name}: {bounds_of(binding['constraint'])}")
    return f"<{', '.join(parts)}>" if parts else ""


def generic_argument(arg: Item) -> str:
    return str(arg["lifetime"]) if "lifetime" in arg else term(arg)


def term(arg: Item) -> str:
    if "type" in arg:
        return type_of(arg["type"])
    constant: Item = arg["const"] if "const" in arg else arg["constant"]
    return str(constant["expr"])


def path_of(path: Item) -> str:
    return str(path["path"]).rsplit("::", 1)[-1] + arguments_of(path["args"])


def bound_of(bound: Item) -> str:
    if "trait_bound" in bound:
        inside = bound["trait_bound"]
        return {"none": "", "maybe": "?", "maybe_const": "~const "}[inside["modifier"]] + for_all(inside["generic_params"]) + path_of(inside["trait"])
    if "outlives" in bound:
        return str(bound["outlives"])
    return f"use<{joined(bound['use'], lambda arg: next(iter(arg.values())))}>"


def bounds_of(bounds: list[Item]) -> str:
    return " + ".join(bound_of(bound) for bound in bounds)


def for_all(params: list[Item]) -> str:
    return f"for<{joined(params, lambda p: p['name'])}> " if params else ""


def result_of(output: Item | None) -> str:
    return f" -> {type_of(output)}" if output else ""


def type_of(ty: Any) -> str:
    if ty == "infer":
        return "_"
    [(what, of)] = ty.items()
    match what:
        case "resolved_path":
            return path_of(of)
        case "generic" | "primitive":
            return str(of)
        case "tuple":
            return f"({joined(of, type_of)}{',' if len(of) == 1 else ''})"
        case "slice":
            return f"[{type_of(of)}]"
        case "array":
            return f"[{type_of(of['type'])}; {of['len']}]"
        case "borrowed_ref":
            lifetime = f"{of['lifetime']} " if of["lifetime"] else ""
            inside = type_of(of["type"])
            return f"&{lifetime}{'mut ' if of['is_mutable'] else ''}{f'({inside})' if ' + ' in inside and inside.startswith('dyn') else inside}"
        case "raw_pointer":
            return f"*{'mut' if of['is_mutable'] else 'const'} {type_of(of['type'])}"
        case "impl_trait":
            return f"impl {bounds_of(of)}"
        case "dyn_trait":
            traits = [for_all(t["generic_params"]) + path_of(t["trait"]) for t in of["traits"]]
            return "dyn " + " + ".join(traits + ([of["lifetime"]] if of["lifetime"] else []))
        case "function_pointer":
            return f"{for_all(of['generic_params'])}fn({joined(of['sig']['inputs'], lambda i: type_of(i[1]))}){result_of(of['sig']['output'])}"
        case "qualified_path":
            name = of["name"] + arguments_of(of["args"])
            if of["trait"] is None or of["self_type"] == {"generic": "Self"}:
                return f"{type_of(of['self_type'])}::{name}"
            return f"<{type_of(of['self_type'])} as {path_of(of['trait'])}>::{name}"
    raise ValueError(f"a type that tests/surface does not know: {what}")


def generics_of(generics: Item) -> tuple[str, str]:
    """What stands in angle brackets after a name, and the clause `where`."""
    names = []
    for param in generics["params"]:
        [(what, of)] = param["kind"].items()
        if what == "lifetime":
            names.append(param["name"] + (f": {' + '.join(of['outlives'])}" if of["outlives"] else ""))
        elif what == "const":
            names.append(f"const {param['name']}: {type_of(of['type'])}")
        elif not of["is_synthetic"]:
            names.append(param["name"] + (f": {bounds_of(of['bounds'])}" if of["bounds"] else ""))
    clauses = []
    for clause in generics["where_predicates"]:
        [(what, of)] = clause.items()
        if what == "bound_predicate":
            clauses.append(f"{for_all(of['generic_params'])}{type_of(of['type'])}: {bounds_of(of['bounds'])}")
        elif what == "lifetime_predicate":
            clauses.append(f"{of['lifetime']}: {' + '.join(of['outlives'])}")
        else:
            clauses.append(f"{type_of(of['lhs'])} = {term(of['rhs'])}")
    return (f"<{', '.join(names)}>" if names else "", f" where {', '.join(clauses)}" if clauses else "")


def input_of(argument: list[Any]) -> str:
    name, ty = argument
    if name == "self":
        whole = type_of(ty)
        return {"Self": "self", "&Self": "&self", "&mut Self": "&mut self"}.get(whole, f"self: {whole}")
    return f"{name}: {type_of(ty)}"


def function(item: Item) -> str:
    of = item["inner"]["function"]
    before = "".join(word + " " for word in ("const", "async", "unsafe") if of["header"][f"is_{word}"])
    names, where = generics_of(of["generics"])
    sig = of["sig"]
    return f"{before}fn {item['name']}{names}({joined(sig['inputs'], input_of)}){result_of(sig['output'])}{where}"


@dataclass
class Block:
    """A public name: its line, and one line for each member. Members that an outsider must know of all of break users when one is added."""

    line: str
    members: list[str]

    def text(self) -> str:
        return "\n".join([self.line] + [f"    {member}" for member in self.members])


def fields(index: Item, numbers: list[int | None]) -> list[str]:
    return ["_" if n is None else type_of(index[str(n)]["inner"]["struct_field"]) for n in numbers]


def named_fields(index: Item, numbers: list[int]) -> list[str]:
    return [f"{index[str(n)]['name']}: {type_of(index[str(n)]['inner']['struct_field'])}" for n in numbers]


def variant(index: Item, item: Item) -> str:
    shape = item["inner"]["variant"]["kind"]
    if shape == "plain":
        return str(item["name"])
    if "tuple" in shape:
        return f"{item['name']}({', '.join(fields(index, shape['tuple']))})"
    hidden = [".."] if shape["struct"]["has_stripped_fields"] else []
    return f"{item['name']} {{ {', '.join(named_fields(index, shape['struct']['fields']) + hidden)} }}"


def associated(index: Item, number: int) -> str:
    """A method, constant or type of a trait or a type."""
    item = index[str(number)]
    [(what, of)] = item["inner"].items()
    if what == "function":
        return function(item)
    if what == "assoc_const":
        return f"const {item['name']}: {type_of(of['type'])}"
    bounds = f": {bounds_of(of['bounds'])}" if of["bounds"] else ""
    return f"type {item['name']}{bounds}" + (f" = {type_of(of['type'])}" if of["type"] else "")


def implemented(index: Item, numbers: list[int]) -> list[str]:
    """Methods and traits of a type. What the compiler implements by itself for every type is left out."""
    methods, traits = [], []
    for number in numbers:
        of = index[str(number)]["inner"]["impl"]
        if of["trait"] is None:
            methods += [associated(index, n) for n in of["items"]]
        elif not of["is_synthetic"] and not of["blanket_impl"] and of["trait"]["path"] != "StructuralPartialEq":
            kinds = [associated(index, n) for n in of["items"] if kind(index[str(n)]) == "assoc_type"]
            traits.append(path_of(of["trait"]) + (f" ({', '.join(kinds)})" if kinds else ""))
    return sorted(methods) + [f"impl {name}" for name in sorted(traits)]


def block(index: Item, name: str, item: Item) -> Block:
    [(what, of)] = item["inner"].items()
    open_end = "#[non_exhaustive] " if "non_exhaustive" in item["attrs"] else ""
    if what in ("struct", "enum", "union", "trait"):
        names, where = generics_of(of["generics"])
    if what == "struct":
        shape = of["kind"]
        if shape == "unit":
            return Block(f"{open_end}struct {name}{names}{where}", implemented(index, of["impls"]))
        if "tuple" in shape:
            return Block(f"{open_end}struct {name}{names}({', '.join(fields(index, shape['tuple']))}){where}", implemented(index, of["impls"]))
        hidden = [".."] if shape["plain"]["has_stripped_fields"] else []
        return Block(f"{open_end}struct {name}{names}{where}", named_fields(index, shape["plain"]["fields"]) + hidden + implemented(index, of["impls"]))
    if what == "enum":
        variants = [variant(index, index[str(n)]) for n in of["variants"]]
        return Block(f"{open_end}enum {name}{names}{where}", variants + implemented(index, of["impls"]))
    if what == "trait":
        above = f": {bounds_of(of['bounds'])}" if of["bounds"] else ""
        items = [associated(index, n) + (" { .. }" if provided(index[str(n)]) else "") for n in of["items"]]
        return Block(f"trait {name}{names}{above}{where}", items)
    if what == "function":
        return Block(function(item | {"name": name}), [])
    if what == "type_alias":
        names, where = generics_of(of["generics"])
        return Block(f"type {name}{names} = {type_of(of['type'])}{where}", [])
    if what in ("constant", "static"):
        return Block(f"{'const' if what == 'constant' else 'static'} {name}: {type_of(of['type'])}", [])
    if what == "use":
        return Block(f"use {of['source']}", [])
    return Block(f"{what} {name}", [])


def provided(item: Item) -> bool:
    """Whether a trait says itself what this item is, so that an implementation need not."""
    [(what, of)] = item["inner"].items()
    return bool(of["has_body"] if what == "function" else of["value"] if what == "assoc_const" else of["type"])
