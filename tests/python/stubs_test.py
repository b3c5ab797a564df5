# SPDX-License-Identifier: Apache-2.0
"""The stubs name exactly what the extension has, with the same arguments; everything public has a docstring and types."""
import ast
import inspect
import pathlib
import re
import unittest

import shadowdag as sd
from shadowdag import _native

STUBS = ast.parse((pathlib.Path(sd.__file__).parent / "_native.pyi").read_text())
IGNORED = {"frame"}  # given to the classes by the package


def public(made):
    return {name for name in vars(made) if not name.startswith("_") and name not in IGNORED}


def arguments(function):
    """Returns the names of a stub's arguments but self."""
    every = [a.arg for a in function.args.posonlyargs + function.args.args + function.args.kwonlyargs]
    return [name for name in every if name != "self"]


class Stubs(unittest.TestCase):
    def test_the_module_has_the_names_of_its_stubs(self):
        named = {node.name for node in STUBS.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
        named |= {node.target.id for node in STUBS.body if isinstance(node, ast.AnnAssign) and node.target.id[0] != "_"}
        self.assertEqual(named, public(_native))

    def test_classes_have_the_members_of_their_stubs(self):
        checked = 0
        for node in STUBS.body:
            if isinstance(node, ast.ClassDef) and not issubclass(getattr(_native, node.name), BaseException):
                made = getattr(_native, node.name)
                named = {item.name for item in node.body if isinstance(item, ast.FunctionDef) and item.name[0] != "_"}
                self.assertEqual(named - IGNORED, public(made), node.name)
                checked += 1
        self.assertEqual(checked, 3)

    def test_functions_take_the_arguments_of_their_stubs(self):
        checked = 0
        owners = [(_native, STUBS.body)] + [(getattr(_native, node.name), node.body) for node in STUBS.body
                                            if isinstance(node, ast.ClassDef)]
        for owner, body in owners:
            for node in body:
                if not isinstance(node, ast.FunctionDef) or node.name in IGNORED or node.decorator_list:
                    continue
                signature = getattr(owner, node.name).__doc__.splitlines()[0]
                inner = re.fullmatch(r"\w+\((.*)\) -> .*", signature)[1]
                taken = [name for name in re.findall(r"(\w+): ", re.sub(r"\[[^]]*\]", "", inner)) if name != "self"]
                self.assertEqual(taken, arguments(node), node.name)
                checked += 1
        self.assertGreater(checked, 12)

    def test_everything_public_says_what_it_does(self):
        for name in sd.__all__:
            made = getattr(sd, name)
            if isinstance(made, tuple):
                continue
            self.assertTrue(inspect.getdoc(made), name)
            for member in public(made) if inspect.isclass(made) and not issubclass(made, BaseException) else ():
                self.assertTrue(inspect.getdoc(getattr(made, member)), f"{name}.{member}")

    def test_everything_public_in_python_is_annotated(self):
        checked = 0
        functions = [getattr(sd, name) for name in sd.__all__] + [vars(sd.Results)[name] for name in public(sd.Results)]
        for function in functions:
            function = function.fget if isinstance(function, property) else function
            if not inspect.isfunction(function):
                continue
            for name, parameter in inspect.signature(function).parameters.items():
                self.assertTrue(name == "self" or parameter.annotation is not parameter.empty, f"{function.__name__}: {name}")
            self.assertIn("return", function.__annotations__, function.__name__)
            checked += 1
        self.assertGreater(checked, 15)


if __name__ == "__main__":
    unittest.main()
