"""The command rosmodel as tests run it."""

import pytest
from ros_model.cli.rosmodel import main


@pytest.fixture
def run(capsys):
    """Run the command rosmodel; gives exit status, standard output and standard error."""

    def run_command(*arguments):
        with pytest.raises(SystemExit) as done:
            main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        assert "Traceback" not in captured.err
        return done.value.code, captured.out, captured.err

    return run_command
