"""Paths in messages are as the user gave them: nobody has to compare relative paths with absolute ones."""

import pytest

BASE = """RosSystem { Name lift RosComponents (
    ComponentInterface { name door FromRosNode 'lifts.door.py.door'
        RosParameters { RosParameter speed { RefParameter 'lifts.door.py.door.speed' value 1.0 } } } ) }"""
PACKAGES = """PackageSet { CatkinPackage lifts { Artifact door.py { Node { name door
    Parameters { Parameter { name speed type Double } } } } } }"""
HAND = """RosSystem { Name careful RosComponents ( ComponentInterface { name door FromRosNode 'lifts.door.py.door' } )
    Parameters { Parameter { name qa_speed type Double value 0.1 } } }"""
SETTINGS = """package: lifts
base: lift.rossystem
variants: [{component: door, table: doors.csv, qa: qa.csv}, {component: door}]
functions: {f: {designs: all}}
quality_attributes: {speed: {direction: higher_is_better, range: [0, 1]}}
utility: speed
objectives: {o: {function: f}}
components: {}
"""
FILES = {
    "models/lift.rossystem": BASE,
    "models/lifts.ros": PACKAGES,
    "models/metacontrol.yaml": SETTINGS,
    "models/doors.csv": "name,door.speed\nslow,0.5\nfast,0.9\n",
    "models/qa.csv": "name,speed\nslow,0.5\nfast,0.9\n",
    "models/variants/careful.rossystem": HAND,
}
FAULTS = {
    "models/lift.rossystem": ("door.py.door'", "door.py.dor'"),
    "models/lifts.ros": ("type Double", "type Double default fast"),
    "models/metacontrol.yaml": ("utility: speed", "utility: sped"),
    "models/doors.csv": ("door.speed", "speed"),
    "models/qa.csv": ("0.9", "7"),
    "models/variants/careful.rossystem": ("door.py.door'", "door.py.dor'"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    def write(fault=None):
        for name, text in FILES.items():
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text.replace(*FAULTS[name]) if name == fault else text)
        monkeypatch.chdir(tmp_path)
        return tmp_path

    return write


def test_models_without_a_fault_are_sound(run, folder):
    folder()
    status, out, _ = run("check", "models")
    assert (status, "error" in out) == (0, False)


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize(
    "command",
    [("check", "models"), ("check", "models/metacontrol.yaml"), ("generate", "all", "models", "-o", ".")],
    ids=" ".join,
)
def test_messages_show_relative_paths_where_relative_ones_were_given(run, folder, fault, command):
    root = str(folder(fault))
    status, out, err = run(*command)
    assert status in {1, 2}
    assert f"{fault}:" in out + err
    assert root not in out + err


@pytest.mark.parametrize("fault", FAULTS)
def test_messages_show_absolute_paths_where_absolute_ones_were_given(run, folder, fault):
    root = str(folder(fault))
    _, out, _ = run("check", f"{root}/models")
    shown = [line for line in out.splitlines() if "error" in line]
    assert shown
    assert all(line.startswith(f"{root}/models/") for line in shown)


@pytest.mark.parametrize("place", ["models/variants", "models", "."])
def test_check_of_a_variant_knows_its_project_wherever_it_is_called(run, folder, monkeypatch, place):
    root = folder("models/variants/careful.rossystem")
    monkeypatch.chdir(root / place)
    name = {"models/variants": "", "models": "variants/", ".": "models/variants/"}[place] + "careful.rossystem"
    status, out, _ = run("check", name)
    assert status == 1
    assert out.startswith(f"{name}:1:")
    assert "declares no node 'dor'" in out
    assert str(root) not in out


def test_models_that_generated_files_would_not_find_are_told_as_they_were_given(run, folder):
    root = folder()
    (root / "models").rename(root / "modelle")
    status, _, err = run("generate", "all", "modelle", "-o", ".")
    assert (status, err.partition(":")[2].startswith(" modelle: generated files look for the models")) == (2, True)
