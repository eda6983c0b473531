# The restitution that a measured drop test asks for. A record that cannot be
# used is refused before any drop is run.


rule read_drop_record:
    input:
        drop_record,
    output:
        of_calibration("record.json"),
    log:
        of_calibration("logs/record.log"),
    benchmark:
        of_calibration("benchmarks/record.tsv")
    conda:
        "../envs/python.yaml"
    params:
        fall_time=fall_time,
        source=source_hash("dragchain.record"),
    shell:
        "dragchain record {input} --fall-time {params.fall_time} --out {output} 2>&1 | tee -i {log}"


rule sweep_drops:
    input:
        calibration_inputs(),
        of_calibration("record.json"),
    output:
        of_calibration("sweep/drops.json"),
    log:
        of_calibration("logs/sweep.log"),
    benchmark:
        of_calibration("benchmarks/sweep.tsv")
    conda:
        "../envs/python.yaml"
    params:
        study=STUDY,
        fidelity=fidelity_option,
        source=source_hash("dragdeck.calibration"),
    shell:
        "dragdeck drops {params.study} sweep {params.fidelity}"
        " --out $(dirname {output}) 2>&1 | tee -i {log}"


rule fit_restitution:
    input:
        record=drop_record,
        drops=of_calibration("sweep/drops.json"),
    output:
        result=of_calibration("result.json"),
        impacts=of_calibration("impacts.csv"),
        bias=of_calibration("bias.csv"),
    log:
        of_calibration("logs/fit.log"),
    benchmark:
        of_calibration("benchmarks/fit.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.calibration"),
    shell:
        "dragchain calibrate {input.record} --drops {input.drops}"
        " --out $(dirname {output.result}) 2>&1 | tee -i {log}"


rule confirm_restitution:
    input:
        calibration_inputs(),
        fit=of_calibration("result.json"),
    output:
        of_calibration("confirm/drops.json"),
    log:
        of_calibration("logs/confirm.log"),
    benchmark:
        of_calibration("benchmarks/confirm.tsv")
    conda:
        "../envs/python.yaml"
    params:
        study=STUDY,
        fidelity=fidelity_option,
        source=source_hash("dragdeck.calibration"),
    shell:
        "dragdeck drops {params.study} confirm {params.fidelity} --fit {input.fit}"
        " --out $(dirname {output}) 2>&1 | tee -i {log}"


rule drop_for_trials:
    input:
        calibration_inputs(),
        of_calibration("record.json"),
    output:
        of_calibration("trials/drops.json"),
    log:
        of_calibration("logs/trial_drops.log"),
    benchmark:
        of_calibration("benchmarks/trial_drops.tsv")
    conda:
        "../envs/python.yaml"
    params:
        study=STUDY,
        fidelity=fidelity_option,
        source=source_hash("dragdeck.calibration"),
    shell:
        "dragdeck drops {params.study} trials {params.fidelity} --count 10 --seed 1"
        " --out $(dirname {output}) 2>&1 | tee -i {log}"


rule recover_trials:
    input:
        sweep=of_calibration("sweep/drops.json"),
        trials=of_calibration("trials/drops.json"),
    output:
        summary=of_calibration("trials.json"),
        rows=of_calibration("trials.csv"),
    log:
        of_calibration("logs/trials.log"),
    benchmark:
        of_calibration("benchmarks/trials.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.calibration"),
    shell:
        "dragchain trials --drops {input.sweep} --trials {input.trials}"
        " --seed 1 --out {output.summary} 2>&1 | tee -i {log}"


rule write_calibration_report:
    input:
        rules.fit_restitution.output,
        rules.recover_trials.output,
        of_calibration("sweep/drops.json"),
        of_calibration("confirm/drops.json"),
        record=drop_record,
        templates=page_templates("calibration.html.j2"),
    output:
        page=report(
            of_calibration("report.html"),
            caption="../report/calibration.rst",
            category="Calibration",
            labels={"run": "drop test", "figure": "report"},
        ),
        figures=[
            of_calibration(f"figures/{name}.png") for name in ("impacts", "fit", "bias", "trials")
        ],
    log:
        of_calibration("logs/report.log"),
    benchmark:
        of_calibration("benchmarks/report.tsv")
    conda:
        "../envs/python.yaml"
    params:
        source=source_hash("dragchain.calibration_report"),
    shell:
        "dragchain calibration-report {input.record} $(dirname {output.page}) 2>&1 | tee -i {log}"
