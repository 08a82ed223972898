"""How Numba compiles a function that is only called by compiled code: no further than it must.

Numba makes of every function machine code of its own and two wrappers for Python. A function that
ends up inside its callers needs neither, and these are much of what a first picture has to compile.
What a piece is compiled to is left as LLVM's intermediate code, which callers link.
"""

from __future__ import annotations

from numba import njit, types
from numba.core import typed_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import register_pass


class _Piece(JITCodeLibrary):
    """Intermediate code that is linked into callers and never becomes machine code itself."""

    def _optimize_final_module(self):
        """Leave it to the callers, which optimise all that they are made of at once."""

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(typed_passes.NativeLowering):
    """Lower to a `_Piece`, and let callers know of it."""

    _name = "piece_lowering"

    def run_pass(self, state):
        """Run the pass; there is no entry point for Python."""
        codegen = state.targetctx.codegen()
        state.library = _Piece(codegen, state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        entry = object()  # callers know a function by this
        state["cr"] = state["cr"]._replace(cfunc=entry)
        state.targetctx.insert_user_function(entry, state["cr"].fndesc, [state.library])
        # The oldest versions of Numba keep none.
        state.reload_init.extend(getattr(state.library, "_reload_init", ()))
        return True


class Compiler(CompilerBase):
    """Numba's passes, with the last one replaced."""

    def define_pipelines(self):
        """Return the one way to compile."""
        builder = DefaultPassBuilder.define_nopython_pipeline(self.state)
        builder.passes = [
            (_Lowering if step is typed_passes.NativeLowering else step, about)
            for step, about in builder.passes
        ]
        builder.finalize()
        return [builder]


def piece(by_value=False, **options):
    """Return a decorator like `numba.njit` for functions that only compiled code calls.

    With `by_value` a function is compiled for every value of a constant that it is called with.
    """
    compiled = njit(
        pipeline_class=Compiler, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options
    )

    def decorate(function):
        dispatcher = compiled(function)

        def refuse(*arguments, **named):
            raise TypeError(f"{function.__qualname__} is for compiled code only")

        # No way leads in from Python: there is nothing to call.
        dispatcher._insert = lambda *entry: None
        dispatcher._compile_for_args = refuse
        return dispatcher if by_value else without_literals(dispatcher)

    return decorate


def without_literals(dispatcher):
    """Have a dispatcher see the types of constants and not their values, and return it.

    Numba types the constants in a call by their values and compiles a function again for each.
    """
    template = dispatcher.get_call_template

    def get_call_template(args, kws):
        plain = {name: types.unliteral(kind) for name, kind in kws.items()}
        return template(tuple(map(types.unliteral, args)), plain)

    dispatcher.get_call_template = get_call_template
    return dispatcher
