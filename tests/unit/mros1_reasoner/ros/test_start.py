"""The node starts without what it does not need."""

import subprocess
import sys


def test_node_imports_no_numpy_and_its_plug_ins_may():
    code = (
        "import sys; from mros1_reasoner.ros import start; start._import_genpy_without_numpy(); "
        "import mros1_reasoner.ros.run, mros1_reasoner.ros.reasoner, genpy; assert 'numpy' not in sys.modules; "
        "import numpy; assert numpy.ones(2).sum() == 2"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
