"""Plug-ins of every kind, in packages that are on ROS_PACKAGE_PATH."""

from types import SimpleNamespace

import pytest
from click.testing import CliRunner
from mros1_reasoner.planning.utility import UtilityError, make_utility
from node_kit.plugins import PluginError, find, named
from ros_model.cli import rosmodel as cli
from ros_model.errors import ModelError
from ros_model.generators import find_generators
from rosgraph_launcher.description import SystemDescription
from rosgraph_manipulator.change.tactics import NoRunningNodes, load_tactics, plan_change
from rosgraph_monitor.observers import plugins as observers


def use_tactic():
    return load_tactics()["Mine"]


def use_utility():
    return make_utility({"Mine": 1}, {})


def use_generator():
    return find_generators()["Mine"](SimpleNamespace(), None)


def use_observer():
    return observers.make("Mine")


def use_command():
    """Run `rosmodel Mine`; the error is the one that its main function tells."""
    done = CliRunner().invoke(cli.command, ["Mine", "--option"])
    if done.exception:
        raise done.exception
    return done


KINDS = {
    "tactic": ("rosgraph_manipulator", use_tactic, PluginError),
    "utility": ("mros1_reasoner", use_utility, UtilityError),
    "generator": ("ros_model", use_generator, ModelError),
    "observer": ("rosgraph_monitor", use_observer, PluginError),
    "command": ("ros_model", use_command, ModelError),
}

BROKEN = {
    "syntax error": ("def Mine(:\n", "SyntaxError"),
    "missing attribute": ("", "AttributeError"),
    "missing module": ("import no_such_module_here\n", "ModuleNotFoundError"),
    "exit": ("raise SystemExit('I leave')\n", "SystemExit: I leave"),
    "several lines": ("raise ValueError('one\\ntwo')\n", "ValueError: one two"),
    "not callable": ("Mine = 5\n", "can't be called"),
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Make a package with one export, of this source; its module's name is its own."""
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))

    def make(name, kind, source="", target="{module}:Mine"):
        folder = tmp_path / name
        folder.mkdir()
        module = f"plugin_of_{name}_{abs(hash(tmp_path))}"
        where = target.format(module=module)
        attributes = f'observer="{where}"' if kind == "observer" else f'{kind}="Mine" function="{where}"'
        (folder / "package.xml").write_text(
            f"<package format='2'><name>{name}</name><version>0.0.1</version><description>x</description>"
            "<maintainer email='a@b.example'>a</maintainer><license>x</license>"
            f"<export><{KINDS[kind][0]} {attributes}/></export></package>"
        )
        (folder / f"{module}.py").write_text(source)
        monkeypatch.syspath_prepend(str(folder))
        return where

    return make


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("what", BROKEN)
def test_broken_plugin_of_any_kind_gives_one_line_with_package_tag_target_error_and_remedy(package, kind, what):
    source, error = BROKEN[what]
    target = package("poetry", kind, source)
    tag, use, refusal = KINDS[kind]
    with pytest.raises(refusal) as refused:
        use()
    line = str(refused.value)
    assert line.startswith(f"package poetry: package.xml: <{tag} {kind}='Mine'>: {target} ")
    assert error in line
    assert line.endswith((": correct it, or remove the export from package.xml", ": name a function or a class"))
    assert "\n" not in line


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("target", ["../x:Mine", "os;ls:Mine"])
def test_export_without_a_module_says_so(package, kind, target):
    package("poetry", kind, target=target)
    with pytest.raises(KINDS[kind][2], match=r"package poetry: .*: name one as MODULE:ATTRIBUTE"):
        KINDS[kind][1]()


@pytest.mark.parametrize("kind", sorted(KINDS.keys() - {"observer"}))
@pytest.mark.parametrize("target", ["", "no_module", "os:"])
def test_export_without_an_attribute_says_so(package, kind, target):
    package("poetry", kind, target=target)
    with pytest.raises(KINDS[kind][2], match=r"package poetry: .*: name one as MODULE:ATTRIBUTE"):
        KINDS[kind][1]()


@pytest.mark.parametrize("kind", KINDS)
def test_second_plugin_of_a_name_is_refused_with_both_packages(package, kind):
    package("poetry", kind, "def Mine(*_): pass\n")
    package("prose", kind, "def Mine(*_): pass\n")
    with pytest.raises(KINDS[kind][2], match=r"package prose: .*: package poetry exports one of that name, too"):
        KINDS[kind][1]()


@pytest.mark.parametrize("kind", ["utility", "generator", "observer"])
@pytest.mark.parametrize("failure", ["raise SystemExit('I leave')", "raise ValueError('no\\nway')", "sys.exit()"])
def test_factory_that_raises_gives_one_line(package, kind, failure):
    base = "import sys\nfrom rosgraph_monitor.observer import Observer\n"
    source = {"observer": f"class Mine(Observer):\n    def __init__(self, name):\n        {failure}\n"}
    package("poetry", kind, base + source.get(kind, f"def Mine(*_):\n    {failure}\n"))
    with pytest.raises(KINDS[kind][2], match=r"^package poetry: .*:Mine fails: \w+:.* remove the export") as refused:
        KINDS[kind][1]()
    assert "\n" not in str(refused.value)


def test_tactic_that_exits_is_left_out():
    def leave(_difference, _nodes):
        raise SystemExit("I leave")

    nothing = SystemDescription()
    assert plan_change(nothing, nothing, NoRunningNodes(), {"mine": leave}) == (
        [],
        ["tactic mine makes no plan: SystemExit: I leave"],
    )


@pytest.mark.parametrize(("kind", "problem"), [("utility", "returned None"), ("generator", "TypeError")])
def test_factory_that_returns_nothing_gives_one_line(package, kind, problem):
    package("poetry", kind, "def Mine(*_): pass\n")
    with pytest.raises(KINDS[kind][2], match=f"package poetry: .*{problem}"):
        KINDS[kind][1]()


def test_what_is_no_observer_and_no_command_is_refused(package):
    package("poetry", "observer", "def Mine(*_): pass\n")
    package("prose", "command", "def Mine(*_): pass\n")
    with pytest.raises(PluginError, match=r"package poetry: .* is no observer: derive it from"):
        use_observer()
    with pytest.raises(ModelError, match=r"package prose: .* is no command: decorate it"):
        use_command()


def test_good_plugin_of_each_kind_works(package):
    package("a_tactic", "tactic", "def Mine(difference, facts): pass\n")
    package("a_utility", "utility", "def Mine(parameters, qualities): return lambda design: parameters\n")
    package("a_generator", "generator", "def Mine(project, output): return ['a file']\n")
    package("an_observer", "observer", "from rosgraph_monitor.observer import Observer\nclass Mine(Observer): pass\n")
    package(
        "a_command",
        "command",
        "import click\n@click.command()\n@click.option('--option', is_flag=True)\n"
        "def Mine(option): click.echo('did it')\n",
    )
    assert use_tactic()(None, None) is None
    assert use_utility()(None) == 1
    assert use_generator() == ["a file"]
    assert use_observer().name == "Mine"
    assert use_command().output == "did it\n"


def test_broken_command_does_not_hide_the_others(package):
    package("poetry", "command", "def Mine(:\n")
    lines = CliRunner().invoke(cli.command, ["--help"]).output.splitlines()
    assert any(line.split() == ["Mine", "(can't", "be", "loaded)"] for line in lines)
    assert any(line.split()[:1] == ["check"] for line in lines)


@pytest.mark.parametrize("attributes", ["format='4'", "format='x'", "format='2'"])
def test_package_that_can_not_be_read_does_not_hide_the_others(package, tmp_path, attributes):
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken/package.xml").write_text(
        f"<package {attributes}><name>broken</name><export><rosgraph_manipulator tactic='X'/></export></package>"
    )
    target = package("poetry", "tactic")
    assert [(one.package, one.target) for one in find("rosgraph_manipulator", "tactic").values()] == [
        ("poetry", target)
    ]


def test_nothing_is_imported_until_it_is_loaded(package):
    package("poetry", "tactic", "raise SystemExit\n")
    assert find("rosgraph_manipulator", "tactic")["Mine"].package == "poetry"


def test_error_for_the_plugins_input_passes(package):
    package("poetry", "utility", "from mros1_reasoner.planning.utility import UtilityError\n"
            "def Mine(*_): raise UtilityError('utility Mine: give a number')\n")  # fmt: skip
    with pytest.raises(UtilityError, match=r"^utility Mine: give a number$"):
        use_utility()


def test_target_that_is_named_directly_has_no_package():
    plugin = named("rosgraph_monitor", "observer", "no.such:Thing")
    with pytest.raises(PluginError, match=r"^<rosgraph_monitor observer='Thing'>: no.such:Thing fails: ModuleNotFound"):
        plugin.load()
    assert named("rosgraph_monitor", "observer", "Thing") is None
