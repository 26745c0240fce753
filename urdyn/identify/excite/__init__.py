"""Question -> the most informative motion, proven safe."""

from urdyn.identify.excite.excitation import KINDS, Ask, Excitation, excite, repeated
from urdyn.identify.excite.expected import Expected, expected
from urdyn.identify.excite.proof import Path, Proof, Safe, prove
from urdyn.identify.excite.question import Question, question

__all__ = [
    "KINDS",
    "Ask",
    "Excitation",
    "Expected",
    "Path",
    "Proof",
    "Question",
    "Safe",
    "excite",
    "expected",
    "prove",
    "question",
    "repeated",
]
