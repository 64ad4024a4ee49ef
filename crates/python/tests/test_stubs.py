"""The stubs and the module say the same."""

import ast
import inspect
from pathlib import Path

import anisobond._native as native

STUB = Path(native.__file__).with_name("_native.pyi")


def of_stub():
    """Public names: functions with their parameters, classes with their members'."""
    functions, classes = {}, {}
    for node in ast.parse(STUB.read_text()).body:
        if isinstance(node, ast.FunctionDef):
            functions[node.name] = parameters(node)
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            members = {m.name: m for m in node.body if isinstance(m, ast.FunctionDef)}
            classes[node.name] = (members, [ast.unparse(base) for base in node.bases])
    return functions, classes


def parameters(node):
    """Names of a stub's parameters, each with whether it has a default; `self` and `cls` are left out."""
    a = node.args
    plain = a.posonlyargs + a.args
    plain = list(zip(plain, [None] * (len(plain) - len(a.defaults)) + a.defaults))
    found = [(p.arg, d is not None) for p, d in plain + list(zip(a.kwonlyargs, a.kw_defaults))]
    found = [p for p in found if p[0] not in ("self", "cls")]
    return found + ([(a.kwarg.arg, False)] if a.kwarg else [])


def of_module(function):
    """The same of a native function."""
    signature = inspect.signature(function)
    return [
        (p.name, p.default is not p.empty)
        for p in signature.parameters.values()
        if p.name not in ("self", "cls", "_cls")
    ]


def test_functions_and_classes_are_the_same():
    functions, classes = of_stub()
    public = {n for n in dir(native) if not n.startswith("_")}
    assert public == set(functions) | set(classes)


def test_parameters_of_functions():
    for name, expected in of_stub()[0].items():
        assert of_module(getattr(native, name)) == expected, name


def test_members_of_classes():
    for name, (members, bases) in of_stub()[1].items():
        cls = getattr(native, name)
        assert [b for b in bases] == [b.__name__ for b in cls.__bases__ if b is not object], name
        public = {m for m in vars(cls) if not m.startswith("_")}
        assert public == {m for m in members if not m.startswith("_")}, name
        for member, node in members.items():
            found = getattr(cls, member)
            if member == "__new__":
                assert of_module(cls) == parameters(node), name
            elif any(ast.unparse(d) == "property" for d in node.decorator_list):
                assert inspect.isgetsetdescriptor(found), (name, member)
            elif not member.startswith("_"):
                assert of_module(found) == parameters(node), (name, member)


def test_every_public_thing_has_a_docstring():
    for name in of_stub()[0]:
        assert getattr(native, name).__doc__, name
    for name, (members, _) in of_stub()[1].items():
        assert getattr(native, name).__doc__, name
        for member in members:
            assert member.startswith("_") or getattr(getattr(native, name), member).__doc__, (name, member)


def test_the_package_exports_the_module():
    import anisobond

    hidden = {"command_line"}
    assert {n for n in dir(native) if not n.startswith("_")} - hidden <= set(anisobond.__all__)
    assert all(hasattr(anisobond, name) for name in anisobond.__all__)
