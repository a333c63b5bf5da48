"""What names the code on which faults are counted."""

import subprocess

from helpers import soaking


def test_documents_are_no_code(tmp_path, monkeypatch):
    monkeypatch.setattr(soaking, "ROOT", tmp_path)
    (tmp_path / "src" / "part").mkdir(parents=True)
    code, document = tmp_path / "src" / "part" / "node.py", tmp_path / "src" / "part" / "README.md"
    code.write_text("pass\n")
    document.write_text("A part.\n")
    for words in (("init", "-q"), ("add", "."), ("-c", "user.name=a", "-c", "user.email=a", "commit", "-qm", "begin")):
        subprocess.run(["git", "-C", tmp_path, *words], check=True)
    first = soaking.code("src")
    document.write_text("Another part.\n")
    assert soaking.code("src") == first != "unknown"
    code.write_text("pass  # changed\n")
    assert soaking.code("src") != first
