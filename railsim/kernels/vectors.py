"""Vectors and rotations as values: tuples of three, matrices as tuples of nine, row by row.

Their entries are numbers or `lanes`, for which a formula is worked out for eight bodies or elements
at once.
"""

from railsim.kernels import compiled


@compiled(inline=True)
def plus(a, b):
    """Sum a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled(inline=True)
def minus(a, b):
    """Difference a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled(inline=True)
def negative(a):
    """Opposite vector -a."""
    return -a[0], -a[1], -a[2]


@compiled(inline=True)
def times(factor, a):
    """A number times a vector."""
    return factor * a[0], factor * a[1], factor * a[2]


@compiled(inline=True)
def by_axis(a, b):
    """Products axis by axis, such as a diagonal stiffness matrix times a deflection."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@compiled(inline=True)
def dot(a, b):
    """Scalar product a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled(inline=True)
def cross(a, b):
    """Vector product a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled(inline=True)
def rotate(R, v):
    """Rotated vector R v."""
    return (
        R[0] * v[0] + R[1] * v[1] + R[2] * v[2],
        R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
        R[6] * v[0] + R[7] * v[1] + R[8] * v[2],
    )


@compiled(inline=True)
def rotate_back(R, v):
    """Vector rotated back, R^T v."""
    return (
        R[0] * v[0] + R[3] * v[1] + R[6] * v[2],
        R[1] * v[0] + R[4] * v[1] + R[7] * v[2],
        R[2] * v[0] + R[5] * v[1] + R[8] * v[2],
    )


@compiled(inline=True)
def product(A, C):
    """Matrix product A C."""
    return (
        A[0] * C[0] + A[1] * C[3] + A[2] * C[6],
        A[0] * C[1] + A[1] * C[4] + A[2] * C[7],
        A[0] * C[2] + A[1] * C[5] + A[2] * C[8],
        A[3] * C[0] + A[4] * C[3] + A[5] * C[6],
        A[3] * C[1] + A[4] * C[4] + A[5] * C[7],
        A[3] * C[2] + A[4] * C[5] + A[5] * C[8],
        A[6] * C[0] + A[7] * C[3] + A[8] * C[6],
        A[6] * C[1] + A[7] * C[4] + A[8] * C[7],
        A[6] * C[2] + A[7] * C[5] + A[8] * C[8],
    )


@compiled(inline=True)
def vector_at(rows, row, column):
    """Vector of numbers that begins in a column of a table's row."""
    return rows[row, column], rows[row, column + 1], rows[row, column + 2]


@compiled(inline=True)
def matrix_at(rows, row, column):
    """Matrix of numbers that begins in a column of a table's row."""
    two = vector_at(rows, row, column) + vector_at(rows, row, column + 3)
    return two + vector_at(rows, row, column + 6)


@compiled(inline=True)
def add_at(rows, row, column, v):
    """Add a vector of numbers to columns of a table's row."""
    rows[row, column] += v[0]
    rows[row, column + 1] += v[1]
    rows[row, column + 2] += v[2]
