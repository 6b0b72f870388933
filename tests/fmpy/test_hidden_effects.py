"""A fresh batch of recordings with hidden effects: what `sinew diagnose` says must not contradict what is claimed."""

import subprocess
import sys

from support import ROOT

# One case of every effect of the library, and some of everything else; two to three minutes.
BATCH = "any-known:26,none:8,any-unknown:8,pairs:4"


def test_fresh_hidden_effects_are_named_as_often_as_claimed(sinew, tmp_path, note):
    score = ROOT / "tests" / "hidden_effects" / "score.py"
    command = [sys.executable, score, "--sinew", sinew, "--effects", BATCH, "--keep", tmp_path, "--check"]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    note(done.stdout)  # the seed is in its first line
    assert done.returncode == 0, f"{done.stderr}\n{done.stdout}"
