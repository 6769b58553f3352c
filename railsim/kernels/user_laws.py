"""Laws of one's own: compiled functions, called by their address.

A law has one argument, the address of its block of numbers: first what it gives, then what it is
given.  Who owns the block says which number is which.  So the time loop is compiled without any
law, and a law without the loop.
"""

import ctypes

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from railsim.kernels import compiled


@intrinsic
def _call_law(typingctx, address, block, first):
    def lower(context, builder, signature, values):
        array = context.make_array(signature.args[1])(context, builder, values[1])
        place = builder.gep(array.data, [values[2]])
        kind = ir.FunctionType(ir.VoidType(), [place.type])
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), [place])
        return context.get_dummy_value()

    return types.void(types.int64, block, types.int64), lower


def _call_uncompiled(address, block, first):
    law = ctypes.CFUNCTYPE(None, ctypes.c_void_p)(int(address))
    law(block.ctypes.data + block.itemsize * int(first))


call_law = _call_uncompiled if numba.config.DISABLE_JIT else _call_law
"""Call the law at an address with the block that begins at ``block[first]``."""

# block of a creep law: force on the rail, moment; creepages, spin, semi-axes, friction force,
# Kalker's coefficients, shear modulus, then the law's parameters
CREEP_RESULTS, CREEP_INPUTS = 3, 11
# block of a friction law: factor of the friction; slip velocity, speed of travel, parameters
FRICTION_RESULTS, FRICTION_INPUTS = 1, 2


@compiled(python=False)
def user_creep_law(n, patches, law, G):
    """Forces of a creep law of one's own; zero where nothing is pressed."""
    block = law.block
    for i in range(n):
        patches.T_x[i], patches.T_y[i], patches.M_z[i] = 0.0, 0.0, 0.0
        if patches.mu_N[i] <= 0.0 or patches.a[i] * patches.b[i] <= 0.0:
            continue
        block[3], block[4], block[5] = patches.xi_x[i], patches.xi_y[i], patches.phi[i]
        block[6], block[7], block[8] = patches.a[i], patches.b[i], patches.mu_N[i]
        block[9], block[10], block[11] = patches.c11[i], patches.c22[i], patches.c23[i]
        block[12], block[13] = patches.c33[i], G
        call_law(law.user_law, block, 0)
        patches.T_x[i], patches.T_y[i], patches.M_z[i] = block[0], block[1], block[2]


@compiled(python=False)
def user_friction(n, patches, speed, address, block):
    """Multiply the friction of n patches by a law of the slip velocity [m/s]."""
    for i in range(n):
        xi_x, xi_y = patches.xi_x[i], patches.xi_y[i]
        block[1] = speed[i] * (xi_x * xi_x + xi_y * xi_y) ** 0.5
        block[2] = speed[i]
        call_law(address, block, 0)
        patches.mu_N[i] *= block[0]
