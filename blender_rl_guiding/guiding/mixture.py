"""The seam between guiding and the transport loop: `find`, `sample` and `pdf` at a vertex, in world space.

A guide hands the loop its `directions`: a named tuple, frozen during a pass. The class of the tuple is its kind. Each kind is declared
once (`declare`), with three parts and its reach: the lobes that it draws for.

Symbols: lobe k is picked with probability P_k, and then has the density p_k; R are the lobes within reach, G = sum over R of P_k.
The guide takes the share 1 - alpha of the samples of R, with its own density p_guide:

    p(wi) = sum over all k of P_k p_k(wi) + (1 - alpha) (G p_guide(wi) - sum over R of P_k p_k(wi))
"""

from typing import Any, NamedTuple

from numba.extending import intrinsic

from ..bsdf import surface as bsdf
from ..kernels import part
from ..kernels.kinds import call_by_kind, constant_by_kind
from ..kernels.sampling import F

_reach: dict[type, int] = {}
_find: dict[type, Any] = {}
_sample: dict[type, Any] = {}
_pdf: dict[type, Any] = {}


def declare(kind: type, reach: F, find: Any, sample: Any, pdf: Any) -> None:
    """Name the parts of a kind of directions, and the sum of the ways to spread light (see `bsdf.lobe`) that it draws for.

    find(directions, x, n, wo, lobes, count) -> alpha, 1 where nothing is known; place: anything that the other two want to know.
    sample(directions, place, n, wo, u, v, choice) -> wi, a unit vector on n's side, by three uniform numbers.
    pdf(directions, place, n, wo, wi) -> density of `sample` per solid angle.
    """
    _reach[kind], _find[kind], _sample[kind], _pdf[kind] = int(reach), find, sample, pdf


class Found(NamedTuple):
    """What is known at a vertex."""

    alpha: F  # share of the samples of R that the material keeps
    share: F  # (1 - alpha) G, the probability that the guide draws; 0 where nothing is known
    place: Any  # the kind's own


@part
def find(directions, x, n, wo, lobes, count):
    """What the guide knows of a vertex at x with normal n, outgoing direction wo and `count` lobes."""
    alpha, place = _find_by_kind(directions, x, n, wo, lobes, count)
    share = F(0)
    if alpha < F(1):
        share = (F(1) - alpha) * bsdf.chance_within(lobes, count, reach(directions))
    return Found(alpha, share, place)


@part
def takes(directions, found, lobes, k, rest):
    """Whether the guide draws the direction of lobe k, by the number `rest` that picking the lobe left over."""
    return found.share > F(0) and bsdf.is_within(lobes, k, reach(directions)) and rest >= found.alpha


@part
def sample(directions, found, n, wo, u, v, choice):
    """A direction wi by the guide, from three uniform numbers. Only where it `takes` the sample."""
    return _sample_by_kind(directions, found.place, n, wo, u, v, choice)


@part
def pdf(directions, found, n, wo, wi, pdf_all, pdf_within):
    """p(wi), from both sums over P_k p_k(wi): of all lobes, and of those within reach. wi has to be reflected."""
    if found.share > F(0):
        pdf_guide = _pdf_by_kind(directions, found.place, n, wo, wi)
        pdf_all += found.share * pdf_guide - (F(1) - found.alpha) * pdf_within
    return pdf_all


@intrinsic
def _reach_of(typingctx, directions):
    return constant_by_kind(_reach, directions)


@intrinsic
def _call_find(typingctx, directions, x, n, wo, lobes, count):
    return call_by_kind(typingctx, _find, (directions, x, n, wo, lobes, count))


@intrinsic
def _call_sample(typingctx, directions, place, n, wo, u, v, choice):
    return call_by_kind(typingctx, _sample, (directions, place, n, wo, u, v, choice))


@intrinsic
def _call_pdf(typingctx, directions, place, n, wo, wi):
    return call_by_kind(typingctx, _pdf, (directions, place, n, wo, wi))


# Declared, because type checkers take the typing context for an argument of the call.
reach: Any = _reach_of
_find_by_kind: Any = _call_find
_sample_by_kind: Any = _call_sample
_pdf_by_kind: Any = _call_pdf
