"""The seam between guiding and the transport loop: `find`, `takes`, `sample` and `pdf` at a vertex, in world space.

A guide hands the loop its `directions`: a named tuple, frozen during a pass. The class of the tuple is its kind. Each kind is declared
once (`declare`), with three functions and its reach. The reach is the set of lobes that the guide draws for.

Symbols: P_k is the probability of picking lobe k, p_k is the density of lobe k, R is the set of lobes within reach, G = sum over R of P_k.
If a lobe of R is picked, the guide draws wi with probability 1 - alpha, with its own density p_guide. So wi has the density

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
    """Register a kind of directions. reach: the sum of the ways to spread light that it draws for, see `bsdf.lobe`.

    find(directions, x, n, wo, lobes, count) -> (alpha, place). alpha is 1 if the guide knows nothing. `sample` and `pdf` get place.
    sample(directions, place, n, wo, u, v, choice) -> wi, a unit vector on n's side. u, v, choice: three uniform numbers.
    pdf(directions, place, n, wo, wi) -> density of `sample` per solid angle.
    """
    _reach[kind], _find[kind], _sample[kind], _pdf[kind] = int(reach), find, sample, pdf


class Found(NamedTuple):
    """The guide's knowledge at a vertex."""

    alpha: F  # share of the samples of R that the material keeps
    share: F  # (1 - alpha) G, the probability that the guide draws; 0 if it knows nothing
    place: Any  # the second result of the kind's `find`


@part
def find(directions, x, n, wo, lobes, count):
    """The guide's knowledge at a vertex with position x, normal n, outgoing direction wo and `count` lobes."""
    alpha, place = _find_by_kind(directions, x, n, wo, lobes, count)
    share = F(0)
    if alpha < F(1):
        share = (F(1) - alpha) * bsdf.chance_within(lobes, count, reach(directions))
    return Found(alpha, share, place)


@part
def takes(directions, found, lobes, k, rest):
    """Whether the guide draws wi in place of lobe k: k is in R, and rest >= alpha. rest: the uniform number that `bsdf.pick` returns."""
    return found.share > F(0) and bsdf.is_within(lobes, k, reach(directions)) and rest >= found.alpha


@part
def sample(directions, found, n, wo, u, v, choice):
    """A direction wi that the guide draws with three uniform numbers. Call this only if `takes` is true."""
    return _sample_by_kind(directions, found.place, n, wo, u, v, choice)


@part
def pdf(directions, found, n, wo, wi, pdf_all, pdf_within):
    """p(wi). pdf_all: the sum over all lobes of P_k p_k(wi). pdf_within: the same sum over R. wi must be a reflected direction."""
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


# Typed as Any: a type checker would count the typing context as an argument of the call.
reach: Any = _reach_of
_find_by_kind: Any = _call_find
_sample_by_kind: Any = _call_sample
_pdf_by_kind: Any = _call_pdf
