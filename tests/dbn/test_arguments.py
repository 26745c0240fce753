"""Arguments are a sparse matrix: whatever they do, the dense one does."""

import numpy as np

from urdyn.dbn.arguments import Arguments


def test_it_is_what_the_dense_matrix_is():
    rng, (m, c, p, n) = np.random.default_rng(0), (3, 2, 6, 8)
    states = np.array([[0, 5], [5, 1], [2, 3]])
    of = Arguments(rng.standard_normal((m, c, p)), states, n)
    W = np.zeros((m, c + 2, n))
    W[:, :c, :p] = of.combined
    for row, pair in enumerate(states):
        W[row, [c, c + 1], pair] = 1.0
    root, x, slope = (rng.standard_normal(shape) for shape in ((n, n), (4, 5, n), (5, m, of.count)))
    P = root @ root.T
    np.testing.assert_allclose(of.of(x), np.einsum("mdn,abn->abmd", W, x), atol=1e-12)
    np.testing.assert_allclose(of.across(P), W @ P, atol=1e-12)
    np.testing.assert_allclose(of.within(of.across(P)), W @ P @ W.swapaxes(1, 2), atol=1e-12)
    np.testing.assert_allclose(of.back(slope), np.einsum("amd,mdn->amn", slope, W), atol=1e-12)
