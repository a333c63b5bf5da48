"""How values get into functions: which call an activation stands for, which object, which argument."""

from __future__ import annotations

import ast
import contextlib
from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

from ros_model_extraction.python import known_functions as python_known
from ros_model_extraction.python.callers import Callers, root_frame
from ros_model_extraction.python.modules import Binding, Scope
from ros_model_extraction.python.values import (
    Class,
    Const,
    Frame,
    Instance,
    Items,
    Results,
    Table,
    Unknown,
    Value,
    World,
)

MAX_VALUES = 64
"""Values that one expression may have before it counts as unknown."""


@dataclass(frozen=True)
class Given:
    """An argument: an expression in the frame of the caller, or a value that is known already."""

    expression: ast.expr | None = None
    value: Value | None = None


@dataclass(frozen=True)
class Arguments:
    """The arguments of a call; `is_open` where `*` or `**` brings others that are not known."""

    positional: tuple[Given, ...] = ()
    keywords: Mapping[str, Given] | None = None
    is_open: bool = False

    def get(self, index: int, name: str) -> Given | None:
        """Return the argument at a place or of a name."""
        if 0 <= index < len(self.positional):
            return self.positional[index]
        return (self.keywords or {}).get(name)


class CallEvaluator(ABC):
    """Evaluates the arguments of calls, and the parameters of functions."""

    def __init__(self) -> None:
        """Start without scopes: `program.scopes` are those whose calls count as callers."""
        self.program = Callers(self)
        self._unsettled = 0  # grows with each choice, and with each question that is cut short

    @abstractmethod
    def evaluate(self, node: ast.expr, frame: Frame, world: World) -> Results:
        """Return the values that an expression may have, each with the world in which it has it."""

    @abstractmethod
    def own_budget(self) -> contextlib.AbstractContextManager[None]:
        """Count the steps inside apart from the present question: what is found there is kept for all questions."""

    @abstractmethod
    def annotated(self, results: Results, annotation: ast.expr | None, frame: Frame) -> Results:
        """Return the results, with unknown values replaced by instances of the annotated class."""

    def unsettle(self) -> None:
        """Keep nothing of what is being found out now: it may be incomplete."""
        self._unsettled += 1

    def evaluate_all(self, nodes: Sequence[Given], frame: Frame, world: World) -> list[tuple[list[Value], World]]:
        """Evaluate several arguments in worlds that fit together."""
        found: list[tuple[list[Value], World]] = [([], world)]
        for node in nodes:
            found = [
                ([*values, value], after)
                for values, before in found
                for value, after in self.given(node, frame, before)
            ][: MAX_VALUES + 1]
        return found

    def given(self, argument: Given, frame: Frame, world: World) -> Results:
        """Evaluate an argument of a call that stands in `frame`."""
        if argument.expression is not None:
            return self.evaluate(argument.expression, frame, world)
        return [(argument.value or Unknown(), world)]

    def arguments(self, call: ast.Call, frame: Frame, world: World, skip: int = 0) -> list[tuple[Arguments, World]]:
        """Return the arguments of a call, `*` and `**` taken apart where they are known."""
        found: list[tuple[list[Given], dict[str, Given], bool, World]] = [([], {}, False, world)]
        for argument in call.args:
            if not isinstance(argument, ast.Starred):
                found = [([*p, Given(argument)], k, o, w) for p, k, o, w in found]
                continue
            spread = []
            for p, k, o, w in found:
                for value, after in self.evaluate(argument.value, frame, w):
                    items = python_known.elements(value)
                    spread.append(([*p, *(Given(value=item) for item in items or ())], k, o or items is None, after))
            found = spread
        for keyword in call.keywords:
            if keyword.arg is not None:
                found = [(p, {**k, keyword.arg: Given(keyword.value)}, o, w) for p, k, o, w in found]
                continue
            spread = []
            for p, k, o, w in found:
                for value, after in self.evaluate(keyword.value, frame, w):
                    table = value.items if isinstance(value, Table) else None
                    named = {str(key.value): Given(value=v) for key, v in table or () if isinstance(key, Const)}
                    spread.append((p, {**k, **named}, o or table is None, after))
            found = spread
        return [(Arguments(tuple(p[skip:]), k, o), w) for p, k, o, w in found[:MAX_VALUES]]

    def objects(self, frame: Frame, world: World) -> list[tuple[Instance, World]]:
        """Return what `self` may be in a method's frame."""
        if frame.instance:
            return [(frame.instance, world)]
        owner = frame.scope.owner
        if owner is None:
            return []
        instances = self.program.instances(owner)
        found = []
        for index, chosen in self.choose(("self", frame), len(instances), world):
            instance = instances[index]
            plugin = self.program.plugins.get(instance.scope) if instance.call is None else None
            found.append((instance, chosen.noting(plugin) if plugin else chosen))
        return found

    def _activations(self, frame: Frame, world: World) -> list[tuple[Frame, World]]:
        """Return the frames, with their calls, that "some activation" may stand for."""
        if frame.call is not None:
            return [(frame, world)]
        scope = frame.scope
        known = [(frame, world)]
        if scope.owner and "staticmethod" not in scope.decorators:
            known = [(replace(frame, instance=instance), w) for instance, w in self.objects(frame, world)]
            if scope.name == "__init__":
                return [(self.construction(f.instance, scope.owner), w) for f, w in known if f.instance]
        found = []
        sites = self.program.callers(scope)
        for candidate, before in known:
            for index, after in self.choose(("caller", candidate), len(sites), before):
                site = sites[index]
                if site is None:
                    found.append((candidate, after))
                    continue
                call, at, skip = site
                caller = root_frame(at)
                same = candidate.instance if _is_on_self(call.func, at) else None
                if same and at.owner in self.program.bases(same.scope):
                    caller = replace(caller, instance=same)
                found.append((replace(candidate, call=call, caller=caller, skip=skip), after))
        return found

    def construction(self, instance: Instance, owner: Scope) -> Frame:
        """Return the frame in which a class's own `__init__` runs for an object of it or of a subclass."""
        init = self.program.method(owner, "__init__")
        if init is None:
            return root_frame(owner)
        frame = replace(root_frame(init), instance=instance)
        classes = [base for base in self.program.bases(instance.scope) if isinstance(base, Scope)]
        earlier = (
            [c for c in classes[: classes.index(owner)] if self.program.method(c, "__init__")]
            if owner in classes
            else []
        )
        if not earlier:
            return replace(frame, call=instance.call, caller=instance.frame)
        for subclass in reversed(earlier):
            sub_init = self.program.method(subclass, "__init__")
            for call in sub_init.calls if sub_init else ():
                match call.func:
                    case ast.Attribute(value=ast.Call(func=ast.Name(id="super")), attr="__init__"):
                        skip = 0
                    case ast.Attribute(value=ast.Name(id=name), attr="__init__") if name == owner.name:
                        skip = 1
                    case _:
                        continue
                return replace(frame, call=call, caller=self.construction(instance, subclass), skip=skip)
        return frame

    def parameter(self, binding: Binding, frame: Frame, world: World) -> Results:
        """Return what a function's parameter may be: the object, or what callers pass."""
        scope = frame.scope
        spec = getattr(scope.node, "args", None)
        if not isinstance(spec, ast.arguments):
            return [(Unknown(binding.name), world)]
        places = [*spec.posonlyargs, *spec.args]
        is_method = scope.owner is not None and "staticmethod" not in scope.decorators
        if is_method and places and binding.node is places[0]:
            if "classmethod" in scope.decorators and scope.owner:
                return [(Class(scope.owner), world)]
            return [(instance, w) for instance, w in self.objects(frame, world)]
        names = [argument.arg for argument in places[int(is_method) :]]
        results: Results = []
        for active, w in self._activations(frame, world):
            results += self._passed(binding.name, names, spec, active, w)
        return self.annotated(results, binding.annotation, frame.lexical or frame)

    def _passed(self, name: str, names: Sequence[str], spec: ast.arguments, frame: Frame, world: World) -> Results:
        """Return what the call of a frame passes for a parameter."""
        if frame.call is None or frame.caller is None:
            return [(Unknown(name), world)]
        results: Results = []
        for arguments, w in self.arguments(frame.call, frame.caller, world, frame.skip):
            if spec.vararg and name == spec.vararg.arg:
                rest = arguments.positional[len(names) :]
                found = self.evaluate_all(rest, frame.caller, w)
                results += [(Unknown(name) if arguments.is_open else Items(tuple(v)), after) for v, after in found]
            elif spec.kwarg and name == spec.kwarg.arg:
                taken = {*names, *(argument.arg for argument in spec.kwonlyargs)}
                extra = {k: v for k, v in (arguments.keywords or {}).items() if k not in taken}
                for values, after in self.evaluate_all(list(extra.values()), frame.caller, w):
                    items = zip(map(Const, extra), values, strict=True)
                    results.append((Unknown(name) if arguments.is_open else Table(tuple(items)), after))
            else:
                index = names.index(name) if name in names else -1
                given = arguments.get(index, name)
                if given is not None:
                    results += self.given(given, frame.caller, w)
                elif arguments.is_open or (default := _default(name, spec)) is None:
                    results.append((Unknown(name), w))
                else:
                    results += self.evaluate(default, frame.lexical or frame, w)
        return results

    def choose(self, key: Hashable, count: int, world: World) -> list[tuple[int, World]]:
        """Return the choices among so many, each with its world; the one made before, where one was."""
        if count == 1:
            return [(0, world)]
        self._unsettled += 1
        if key in world.choices:
            return [(world.choices[key], world)]
        return [(index, world.chosen(key, index)) for index in range(count)]


def _default(name: str, spec: ast.arguments) -> ast.expr | None:
    places = [*spec.posonlyargs, *spec.args]
    for argument, default in zip(reversed(places), reversed(spec.defaults), strict=False):
        if argument.arg == name:
            return default
    for argument, only in zip(spec.kwonlyargs, spec.kw_defaults, strict=True):
        if argument.arg == name:
            return only
    return None


def _is_on_self(callee: ast.expr, scope: Scope) -> bool:
    """Return whether a callee is a method of the object in whose method it is called."""
    arguments = getattr(scope.node, "args", None)
    match callee:
        case ast.Attribute(value=ast.Name(id=name)) if isinstance(arguments, ast.arguments) and arguments.args:
            return scope.owner is not None and arguments.args[0].arg == name
    return False
