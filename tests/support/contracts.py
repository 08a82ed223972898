"""A kind of import contract: what some modules may import from outside, and nothing else."""

import sys

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class AllowedContract(Contract):
    """Modules import only the standard library, their own package and what is allowed.

    Configuration: `source_modules`, with all that is inside of them; `allowed_modules`, packages
    from outside.
    """

    source_modules = fields.ListField(subfield=fields.ModuleField())
    allowed_modules = fields.SetField(subfield=fields.ModuleField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Return which modules import what they may not."""
        allowed = {module.name for module in self.allowed_modules} | set(sys.stdlib_module_names)
        allowed |= {source.name.partition(".")[0] for source in self.source_modules}
        found = []
        for source in self.source_modules:
            for module in (source.name, *graph.find_descendants(source.name)):
                for imported in graph.find_modules_directly_imported_by(module):
                    if imported.partition(".")[0] not in allowed:
                        found.append(f"{module} imports {imported}")
        return ContractCheck(kept=not found, metadata={"found": sorted(found)})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print them."""
        for text in check.metadata["found"]:
            output.print_error(text, bold=False)
