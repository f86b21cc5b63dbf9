"""The checker of proofs that there is no climb: accepts them, and refuses what was changed."""

import ast
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from infeasibility_rig import SCRIPTS, record, refusal
from test_check_certificate import change, numbers_of

TAMPERED = 1000


def rehashed(changed: dict[str, Any]) -> dict[str, Any]:
    """The record with the hash of what is in it."""
    from drake_quad.certificate.certify import digest

    return {**changed, "sha256": digest(changed)}


def test_a_proof_is_accepted(tmp_path: Path) -> None:
    """By code of its own, also as a program, whose exit status is 0; changed, it is 1."""
    assert refusal(record()) is None
    path = tmp_path / "proof.json"
    for rise, status in ((record()["climb"]["rise"], 0), (0.2, 1)):
        changed = record()
        changed["climb"]["rise"] = rise
        path.write_text(json.dumps(rehashed(changed)))
        command = [sys.executable, str(SCRIPTS / "check_no.py"), str(path)]
        assert subprocess.run(command, check=False, capture_output=True).returncode == status
    path.write_text("{")
    assert subprocess.run(command, check=False, capture_output=True).returncode == 2


def test_checker_shares_no_code_with_the_prover() -> None:
    """It imports numpy, the reader of certificates, and the standard library."""
    tree = ast.parse((SCRIPTS / "check_no.py").read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        for name in names:
            own = name in ("certificate_reading", "certificate_robot")
            library = name.split(".")[0]
            assert own or library == "numpy" or library in sys.stdlib_module_names


def test_tampered_proofs_are_refused() -> None:
    """None of 1000 records with a number, a letter or a level changed is accepted."""
    rng, accepted = np.random.default_rng(1), 0
    paths = numbers_of(record())
    for _ in range(TAMPERED):
        changed = record()
        kind = rng.integers(4)
        moment = changed["moments"][rng.integers(len(changed["moments"]))]
        level = int(rng.integers(len(moment["tree"])))
        text = moment["tree"][level]
        if kind == 0:
            change(changed, paths[rng.integers(len(paths))], float(rng.choice([1e-6, -1e-3, 1.0])))
        elif kind == 1:
            at, letter = int(rng.integers(len(text))), str(rng.choice(list("xzpabcdst")))
            moment["tree"][level] = text[:at] + letter + text[at + 1 :]
        elif kind == 2:
            del moment["tree"][level]
        else:
            moment["mover"] = (moment["mover"] + 1 + int(rng.integers(3))) % 4
        accepted += changed != record() and refusal(changed) is None
    assert accepted == 0


def falsified(kind: str) -> dict[str, Any]:
    """A record that claims what is not shown, its hash made to fit."""
    changed = record()
    first = changed["moments"][0]
    if kind == "lower stairs":
        changed["climb"]["rise"] *= 0.5
    elif kind == "longer legs":
        changed["robot"]["thighs"] = [2.0 * length for length in changed["robot"]["thighs"]]
    elif kind == "no moment":
        del changed["moments"][0]
    elif kind == "no moments":
        changed["moments"] = []
    elif kind == "no boxes":
        first["tree"] = []
    elif kind == "cut tree":
        del first["tree"][-1]
    elif kind == "closed at once":
        first["tree"] = ["s"]
    elif kind == "all one reason":
        reasons = str.maketrans("abcdt", "sssss")
        first["tree"] = [level.translate(reasons) for level in first["tree"]]
    elif kind == "unknown reason":
        first["tree"][-1] = "?" * len(first["tree"][-1])
    elif kind == "no letters":
        first["tree"] = [[]]
    elif kind == "all feet above":
        first["above"] = [True] * 4
    elif kind == "negative masses":
        changed["robot"]["trunk_mass"] = -1000.0
    elif kind == "hips without end":  # whose differences are no number: any box seems closed
        for hip in changed["robot"]["hips"]:
            hip[1] = 1e200 if hip[1] > 0.0 else -1e200
        changed["climb"]["rise"], changed["boundary"] = 0.1, 3
        changed["moments"] = [
            {"above": [leg != mover for leg in range(4)], "mover": mover, "tree": ["z", "aa"]}
            for mover in range(4)
        ]
    elif kind == "mass without end":  # of which moments overflow
        changed["robot"] |= {"trunk_mass": 1.7e308, "trunk_com": [2.0, 0.0, 0.0]}
    elif kind == "no number":
        changed["climb"]["rise"] = float("nan")
    elif kind == "crossed limits":
        limits = changed["robot"]
        limits["q_lower"], limits["q_upper"] = limits["q_upper"], limits["q_lower"]
    elif kind == "no stairs":
        changed["climb"]["count"] = 0
    elif kind == "true for a number":
        changed["boundary"] = True
    elif kind == "other claim":
        changed["claim"] = "no climb exists"
    elif kind == "turned about":
        changed["climb"]["yaw"] = 3.1
    elif kind == "wider class":
        changed["climb"]["pitch"] = 1.4
    return changed


@pytest.mark.parametrize(
    "kind",
    [
        "lower stairs", "longer legs", "no moment", "no moments", "no boxes", "cut tree",
        "closed at once", "all one reason", "unknown reason", "no letters", "all feet above",
        "negative masses", "hips without end", "mass without end", "no number", "crossed limits",
        "no stairs", "true for a number", "other claim", "turned about", "wider class",
    ],
)  # fmt: skip
def test_a_false_claim_is_refused_whatever_its_hash(kind: str) -> None:
    """By its content alone."""
    assert refusal(falsified(kind), hashed=False) is not None


def test_what_is_accepted_after_a_change_is_a_proof_of_its_own() -> None:
    """With the hash left aside: a letter of a tree may change only to another reason that holds."""
    rng, accepted = np.random.default_rng(2), 0
    for _ in range(30):
        changed = record()
        moment = changed["moments"][rng.integers(len(changed["moments"]))]
        level = int(rng.integers(len(moment["tree"])))
        text = moment["tree"][level]
        at, letter = int(rng.integers(len(text))), str(rng.choice(list("xzpabcdst")))
        moment["tree"][level] = text[:at] + letter + text[at + 1 :]
        if changed == record() or refusal(changed, hashed=False) is not None:
            continue
        accepted += 1
        # The tree's shape is the same: a reason stands for a reason, which holds as well.
        assert (letter in "xzp") == (text[at] in "xzp")
    assert accepted < 30
