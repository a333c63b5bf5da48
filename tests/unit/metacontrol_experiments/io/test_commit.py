"""The commit of the code that runs."""

import pytest
from metacontrol_experiments.io.code_version import current_commit

HASH = "0123456789abcdef0123456789abcdef01234567"


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_commit_comes_from_the_environment_first(monkeypatch):
    monkeypatch.setenv("MROS_COMMIT", "v1")
    assert current_commit() == "v1"


@pytest.mark.parametrize(
    ("head", "files", "expected"),
    [
        (HASH, {}, HASH),
        ("ref: refs/heads/main", {"refs/heads/main": HASH}, HASH),
        ("ref: refs/heads/main", {"packed-refs": f"# pack-refs\n{HASH} refs/heads/main\n"}, HASH),
        ("ref: refs/heads/new", {}, "unknown"),
    ],
)
def test_commit_is_read_without_git(monkeypatch, tmp_path, head, files, expected):
    monkeypatch.delenv("MROS_COMMIT", raising=False)
    write(tmp_path / ".git" / "HEAD", head + "\n")
    for name, text in files.items():
        write(tmp_path / ".git" / name, text)
    assert current_commit(tmp_path / "src" / "module.py") == expected
