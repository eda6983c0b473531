# The workflow of a clone: snakemake all --config study=uhlmann2015 fidelity=standard
include: "workflow/Snakefile"
