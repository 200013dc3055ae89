"""Damaged Abaqus decks: each is read, or refused with one sentence that names the file; no traceback, no hang."""

import random
import time

import pytest

import modalprep as mp

DECK = """*HEADING
a deck of everything
*PART, NAME=p
*NODE, NSET=all, SYSTEM=R
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
11, 2, 0, 0
13, 0, 2, 0
*NGEN, LINE=C, NSET=arc
11, 13, 1, , 0, 0, 0
*NSET, NSET=low
1, 2, 3, 4
*NSET, NSET=high, GENERATE
5, 8, 1
*NFILL
low, high, 2, 100
*NCOPY, OLD SET=low, CHANGE NUMBER=200, SHIFT
0, 0, 5
0, 0, 0, 0, 0, 1, 30
*ELEMENT, TYPE=C3D8, ELSET=c
1, 1, 2, 3, 4, 5,
6, 7, 8
*ELGEN, ELSET=c
1, 1, 1, 1, 1, 1, 1
*ELEMENT, TYPE=S4R, ELSET=s
2, 5, 6, 7, 8
*ELEMENT, TYPE=CPS4, ELSET=flat
9, 201, 202, 203, 204
*SOLID SECTION, ELSET=flat, MATERIAL=steel
.01
*ELEMENT, TYPE=B31, ELSET=b
3, 201, 202
*ELCOPY, OLD SET=b, ELEMENT SHIFT=50, SHIFT NODES=1, NEW SET=b
*ELSET, ELSET=both
c, 2
*ORIENTATION, NAME=o, SYSTEM=CYLINDRICAL
0, 0, 0, 0, 0, 1
3, 30.
*DISTRIBUTION, NAME=d, LOCATION=ELEMENT, TABLE=t
, 1, 0, 0, 0, 1, 0
2, 0, 1, 0, -1, 0, 0
*SOLID SECTION, ELSET=c, MATERIAL=ud, ORIENTATION=o
*SHELL SECTION, ELSET=s, COMPOSITE, OFFSET=SPOS, ORIENTATION=o
.001, 3, steel, 0.
.002, 3, ud, 45.
*BEAM SECTION, ELSET=b, MATERIAL=steel, SECTION=I
.05, .1, .06, .06, .01, .01, .01
0, 1, 0
*SURFACE, NAME=top
c, S2
*SURFACE, NAME=foot
c, S1
*END PART
*ASSEMBLY, NAME=a
*INSTANCE, NAME=i, PART=p
*END INSTANCE
*INSTANCE, NAME=j, PART=p
0, 0, 1
0, 0, 0, 0, 0, 1, 10
*END INSTANCE
*NODE
1, 2, 2, 2
2, 3, 3, 3
*ELEMENT, TYPE=MASS, ELSET=m
1, 1
*MASS, ELSET=m
5.
*ELEMENT, TYPE=SPRINGA, ELSET=k
2, 1, 2
*SPRING, ELSET=k
,
1e5
*NSET, NSET=n, INSTANCE=i
low
*TIE, NAME=t
j.foot, i.top
*COUPLING, CONSTRAINT NAME=q, REF NODE=1, SURFACE=i.foot
*KINEMATIC
1, 3
*RIGID BODY, REF NODE=2, PIN NSET=j.arc
*PRE-TENSION SECTION, SURFACE=i.top, NODE=2
*MPC
PIN, i.203, j.203
*EQUATION
2
i.201, 1, 1., j.201, 1, -2.
*TRANSFORM, NSET=n, TYPE=C
9, 9, 0, 9, 9, 1
*END ASSEMBLY
*MATERIAL, NAME=steel
*ELASTIC
2e11, .3, 20.
1e11, .3, 600.
*DENSITY
7800.
*MATERIAL, NAME=ud
*ELASTIC, TYPE=ENGINEERING CONSTANTS
1e11, 1e10, 1e10, .3, .3, .4, 5e9, 5e9
4e9
*DENSITY
1600.
*BOUNDARY
n, ENCASTRE
*STEP
*FREQUENCY
10
*BOUNDARY, OP=NEW
n, 1, 3
*MODAL DAMPING
1, 9, .02
*END STEP
*STEP
*STATIC
*CLOAD
i.201, 2, 5.
*DLOAD
i.c, P1, 6.
i.c, GRAV, 9.81, 0., 0., -1.
*DSLOAD
i.top, P, 3.
*END STEP
*STEP
*SUBSTRUCTURE GENERATE
*RETAINED NODAL DOFS
i.202, 1, 6
*END STEP
"""
SLOW = 5.0  # s of the processor; the deck takes some milliseconds


def attempt(path, content):
    """Return the message, or nothing when the deck is read."""
    path.write_bytes(content)
    start = time.process_time()
    try:
        mp.read_mesh(path)
        message = ""
    except mp.InputError as error:
        message = str(error)
        assert "deck.inp" in message
        assert "\n" not in message
    assert time.process_time() - start < SLOW
    return message


def damaged(rng, text):
    """Return the deck with some lines, fields or letters lost, doubled, swapped or replaced."""
    lines = text.splitlines()
    for _ in range(rng.randint(1, 3)):
        k, other = rng.randrange(len(lines)), rng.randrange(len(lines))
        fields = lines[k].split(",")
        f = rng.randrange(len(fields))
        kind = rng.randrange(9)
        if kind == 0:
            del lines[k]
        elif kind == 1:
            lines.insert(k, lines[other])
        elif kind == 2:
            lines[k], lines[other] = lines[other], lines[k]
        elif kind == 3:
            fields[f] = rng.choice(["", "-1", "0", "1e400", "nan", "abc", "9" * 12, "1.5", "-", "*", '"', "="])
            lines[k] = ",".join(fields)
        elif kind == 4:
            del fields[f]
            lines[k] = ",".join(fields)
        elif kind == 5:
            lines[k] = ",".join([*fields, *lines[other].split(",")])
        elif kind == 6:
            at = rng.randrange(len(lines[k]) + 1)
            lines[k] = lines[k][:at] + chr(rng.randrange(1, 300)) + lines[k][at:]
        elif kind == 7:
            lines[k] = lines[k][: rng.randrange(len(lines[k]) + 1)]
        else:
            lines[k] = lines[k].replace("=", ",", 1)
        if not lines:
            return ""
    return "\n".join(lines) + "\n"


def test_the_whole_deck_is_read(tmp_path):
    assert attempt(tmp_path / "deck.inp", DECK.encode()) == ""


@pytest.mark.parametrize("seed", range(8))
def test_damaged_decks(seed, tmp_path):
    rng = random.Random(seed)
    found = [attempt(tmp_path / "deck.inp", damaged(rng, DECK).encode()) for _ in range(40)]
    assert 5 < sum(map(bool, found)) < 40  # some are refused, some are read


@pytest.mark.parametrize("start", range(0, len(DECK), 300))
def test_decks_cut_short(start, tmp_path):
    for end in range(start, start + 300, 23):
        attempt(tmp_path / "deck.inp", DECK[:end].encode())


def test_bytes_that_are_no_text(tmp_path):
    rng = random.Random(0)
    for _ in range(20):
        content = bytearray(DECK.encode())
        for _ in range(30):
            content[rng.randrange(len(content))] = rng.randrange(256)
        attempt(tmp_path / "deck.inp", bytes(content))
