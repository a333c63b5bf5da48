"""Evaluates members: of modules, classes and objects, wherever they come from."""

from __future__ import annotations

import ast
from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from ros_model_extraction.python.callers import root_frame
from ros_model_extraction.python.calls import CallEvaluator
from ros_model_extraction.python.modules import Binding, Module, Scope
from ros_model_extraction.python.values import (
    Class,
    Const,
    External,
    Frame,
    Function,
    Instance,
    ModuleValue,
    Results,
    Super,
    Unknown,
    Value,
    World,
)


class MemberEvaluator(CallEvaluator):
    """Evaluates members of values."""

    @abstractmethod
    def _bound(self, bindings: Sequence[Binding], frame: Frame, world: World) -> Results:
        """Return what a name may be that has these bindings."""

    @abstractmethod
    def _binding(self, binding: Binding, frame: Frame, world: World) -> Results:
        """Return what a binding may give its name."""

    @abstractmethod
    def _module_member(self, module: Module, name: str, world: World) -> Results:
        """Return what a name may be in a module; nothing where it has none of it."""

    @abstractmethod
    def _returned(self, scope: Scope, frame: Frame, world: World) -> Results:
        """Return what a function may return."""

    def _member(self, value: Value, name: str, world: World) -> Results:
        found: Results = []
        match value:
            case External(outside):
                found = [(External(f"{outside}.{name}"), world)]
            case ModuleValue(module):
                found = self._module_member(module, name, world)
            case Class(scope):
                found = self._class_member(scope, name, None, world)
            case Instance(scope):
                found = self._attribute(value, name, world)
            case Super(instance, after):
                classes = self.program.bases(instance.scope)
                start = classes.index(after) + 1 if after in classes else len(classes)
                found = self._inherited(classes[start:], name, instance, world)
            case Const() if name == "value":  # of a member of an Enum
                found = [(value, world)]
        return found or [(Unknown(name), world)]

    def _class_member(self, scope: Scope, name: str, instance: Instance | None, world: World) -> Results:
        if name == "__name__":
            return [(Const(scope.name), world)]
        return self._inherited(self.program.bases(scope), name, instance, world)

    def _inherited(
        self, classes: Iterable[Scope | External], name: str, instance: Instance | None, world: World
    ) -> Results:
        for base in classes:
            if isinstance(base, External):
                if base.name in ("builtins.object", "?"):
                    continue
                return [(External(f"{base.name}.{name}"), world)]
            method = self.program.method(base, name)
            if method and instance and method.decorators & {"property", "cached_property"}:
                frame = replace(root_frame(method), instance=instance)
                return self._returned(method, frame, world)
            if method:
                return [(Function(method, root_frame(base), instance), world)]
            values = [b for b in base.bindings.get(name, ()) if b.how == "value" or b.annotation]
            if values:
                return self._bound(values[-1:], root_frame(base), world)
        return [(Unknown(name), world)]

    def _attribute(self, instance: Instance, name: str, world: World) -> Results:
        """Return what an attribute of an object may hold: what its methods assign, its fields, its class's members."""
        classes = [base for base in self.program.bases(instance.scope) if isinstance(base, Scope)]
        if name == "__class__":
            return [(Class(instance.scope), world)]
        assigned = [
            (binding, method)
            for base in classes
            for method in base.inner
            for binding in _assigned(method, name)
            if method.owner is base
        ]
        if assigned:
            results: Results = []
            for index, chosen in self.choose(("attribute", instance, name), len(assigned), world):
                binding, method = assigned[index]
                if method.name == "__init__" and method.owner:
                    frame = self.construction(instance, method.owner)
                else:
                    frame = replace(root_frame(method), instance=instance)
                results += self._binding(binding, frame, chosen)
            known = [(v, w) for v, w in results if not (isinstance(v, Const) and v.value is None)]
            return known or results
        if field := self._field(instance, name, classes, world):
            return field
        return self._class_member(instance.scope, name, instance, world)

    def _field(self, instance: Instance, name: str, classes: Sequence[Scope], world: World) -> Results:
        """Return what was given for a field of a dataclass or named tuple; nothing where it is none."""
        if instance.call is None or instance.frame is None or any(self.program.method(c, "__init__") for c in classes):
            return []
        fields = [
            field
            for base in reversed(classes)
            for field, bindings in base.bindings.items()
            if any(b.annotation is not None for b in bindings)
        ]
        if name not in fields:
            return []
        results: Results = []
        for arguments, w in self.arguments(instance.call, instance.frame, world):
            given = arguments.get(fields.index(name), name)
            if given is not None:
                results += self.given(given, instance.frame, w)
            elif arguments.is_open:
                results.append((Unknown(name), w))
            else:
                results += self._inherited(classes, name, None, w)
        return results


def _assigned(method: Scope, attribute: str) -> Iterator[Binding]:
    """Yield what a method assigns to an attribute of its object, in functions inside it too."""
    arguments = getattr(method.node, "args", None)
    if not isinstance(arguments, ast.arguments) or not arguments.args:
        return
    yield from method.bindings.get(f"{arguments.args[0].arg}.{attribute}", ())
