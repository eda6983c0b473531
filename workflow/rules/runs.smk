# A run from its input script to its figures: a rule for each phase and folder of runs.
# A point of a plan that fails is a finding, and its outcome says how; any other run that
# fails is none, and leaves no run.json. What a process waits for goes before drop tests and figures.

for PLACE, SCENE in PLACES.items():

    rule:
        name:
            f"render_{PLACE}"
        input:
            WORK.templates_of_study(SCENE.name),
            home=home,
            packing=WORK.of_its_bed(PLACE, "tables/packing.json"),
            lead=WORK.of_its_lead(PLACE),
        output:
            deck_files(PLACE, SCENE.inputs),
        wildcard_constraints:
            run=ENGINE_RUN,
        priority: 0 if SCENE.single_particle else 1
        localrule: True
        params:
            case=WORK.digest_of(PLACE),
            cases=WORK.cases_option(PLACE),
            packing="--packing" if SCENE.needs_bed else "",
            source=source_hash("dragdeck.decks.render", "dragdeck.scenes.process"),
            scene=SCENE.name,
        shell:
            "dragdeck step render {wildcards.study} {params.scene} {wildcards.run} {params.cases}"
            " {params.packing} {input.packing} > {log} 2>&1"


for NAME, (PLACE, FILE) in RUNNERS.items():

    rule:
        name:
            NAME
        input:
            deck_files(PLACE, PLACES[PLACE].inputs),
            filling=WORK.of_its_bed(PLACE, "run.json"),
        output:
            of_run(PLACE, FILE),
        wildcard_constraints:
            run=ENGINE_RUN,
        priority: 0 if PLACES[PLACE].single_particle else 1
        threads: WORK.ranks_of(PLACE)
        resources:
            engine=1,
        params:
            outcome="" if FILE == "run.json" else f"--outcome {of_run(PLACE, FILE)}",
            source=source_hash("dragdeck.engine.run_folder"),
        shell:
            "dragdeck run $(dirname {output}) {params.outcome} > {log} 2>&1"


for PLACE in ("process", WINDOWS):

    # Workpieces beyond the first of a run: each has tables, chains and figures of its own.
    rule:
        name:
            f"share_{PLACE}"
        input:
            WORK.templates_of_study("process"),
            home=home,
            run=of_whole_run(PLACE, RECORD[PLACE]),
            packing=WORK.of_its_bed(PLACE, "tables/packing.json"),
        output:
            [
                of_run(PLACE, file)
                for file in (RECORD[PLACE], "case.json", "columns.json", *SCENES["process"].inputs)
            ],
        wildcard_constraints:
            run=FURTHER_WORKPIECE,
        localrule: True
        params:
            case=WORK.digest_of(PLACE),
            cases=WORK.cases_option(PLACE),
            source=source_hash("dragdeck.decks.render", "dragdeck.scenes.process"),
        shell:
            "dragdeck step render {wildcards.study} process {wildcards.run} {params.cases}"
            " --packing {input.packing} > {log} 2>&1"


for PLACE, SCENE in SCENES.items():

    rule:
        name:
            f"tabulate_{PLACE}"
        input:
            of_run(PLACE, "run.json"),
        output:
            tables_of(PLACE, SCENE.tables),
        priority: 0 if SCENE.single_particle else 1
        params:
            source=source_hash("dragchain.tables.write"),
        shell:
            "dragchain tables $(dirname {input}) > {log} 2>&1"

    rule:
        name:
            f"draw_{PLACE}"
        input:
            tables_of(PLACE, [*SCENE.tables, *SCENE.network]),
            of_run(PLACE, "tables/quantities.json") if PLACE == "process" else [],
            run=of_run(PLACE, "run.json"),
        output:
            [
                shown(
                    of_run(PLACE, f"figures/{name}.png"),
                    name,
                    PLACE.replace("_", " ").capitalize(),
                    name,
                    run="{run}",
                )
                for name in figures_of(SCENE.name)
            ],
            of_run(PLACE, "tables/findings.json"),
        params:
            source=source_hash("dragchain.report.run_figures"),
        shell:
            "dragchain figures $(dirname {input.run}) > {log} 2>&1"

    if SCENE.network:

        # The contact network and its chains.
        rule:
            name:
                f"find_chains_of_{PLACE}"
            input:
                tables_of(PLACE, SCENE.tables),
                run=of_run(PLACE, "run.json"),
            output:
                tables_of(PLACE, SCENE.network),
            params:
                source=source_hash("dragchain.network.statistics", "dragchain.network.chains"),
            shell:
                "dragchain chains $(dirname {input.run}) > {log} 2>&1"


# The figures of a run for a publication; --config colours=paper: forces from green to red.
rule draw_for_journal:
    input:
        tables_of("process", [*SCENES["process"].tables, *SCENES["process"].network]),
        of_run("process", "tables/findings.json"),
        run=of_run("process", "run.json"),
    output:
        of_run("process", "figures/journal/workpiece.pdf"),
    params:
        colours="--paper-colours" if COLOURS == "paper" else "",
        source=source_hash("dragchain.report.journal"),
    shell:
        "dragchain journal $(dirname {input.run}) {params.colours} > {log} 2>&1"


# The quantities of a run. A run of a plan and a window get their tables and chains with them.
for PLACE in ("process", POINTS, WINDOWS):

    rule:
        name:
            f"measure_{PLACE}"
        input:
            (
                []
                if PLACE in OUTCOMES
                else tables_of(PLACE, [*SCENES["process"].tables, *SCENES["process"].network])
            ),
            run=of_run(PLACE, RECORD[PLACE]),
            bed=WORK.of_its_bed(PLACE, "tables/packing.json"),
            record=WORK.windows_record,
        output:
            of_run(PLACE, "tables/quantities.json"),
        params:
            source=source_hash("dragchain.quantities.measure"),
        shell:
            "dragchain quantities $(dirname {input.run}) > {log} 2>&1"


# What the windows of a run say so far. Each round decides whether there is another one.
checkpoint judge_windows:
    input:
        WORK.measured_of_round,
        run=of_run("process", "tables/quantities.json"),
        before=WORK.round_before,
        record=WORK.windows_record,
    output:
        of_run("process", "windows/round-{round}.json"),
    localrule: True
    params:
        asked=WORK.windows_options,
        windows=WORK.windows_of_round,
        source=source_hash("dragchain.windows.rounds"),
    shell:
        "dragchain step windows $(dirname $(dirname {output})) --windows {params.windows}"
        " {params.asked} --out {output} > {log} 2>&1"


# What a run is at the physical Young's modulus, by its windows.
rule extrapolate_process:
    input:
        of_run("process", "tables/quantities.json"),
        windows=WORK.last_round,
    output:
        of_run("process", "tables/extrapolated.json"),
    localrule: True
    params:
        packings=WORK.packings_option,
        windows=lambda wildcards, input: f"--round {input.windows}" if input.windows else "",
        source=source_hash("dragchain.windows.extrapolate"),
    shell:
        "dragchain step extrapolate $(dirname $(dirname {output})) {params.packings}"
        " {params.windows} > {log} 2>&1"


# Load, sliding and friction work on the workpiece, facet by facet.
rule map_loading_of_process:
    input:
        tables_of("process", SCENES["process"].tables),
        record=of_run("process", "run.json"),
    output:
        tables_of("process", SCENES["process"].loading),
        shown(
            of_run("process", "figures/workpiece.png"),
            "workpiece",
            "Process",
            "workpiece",
            run="{run}",
        ),
    params:
        source=source_hash("dragchain.loading.summary", "dragchain.loading.figure"),
    shell:
        "dragchain loading $(dirname {input.record}) > {log} 2>&1"
