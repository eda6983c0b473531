# The restitution that a measured drop test asks for. A record that cannot be
# used is refused before any drop is run.


rule read_drop_record:
    input:
        drop_record,
    output:
        of_study("calibration", "record.json"),
    log:
        of_study("calibration", "logs/record.log"),
    benchmark:
        of_study("calibration", "benchmarks/record.tsv")
    conda:
        "../envs/python.yaml"
    resources:
        prints=1,
    params:
        fall_time=fall_time,
        source=source_hash("dragchain.calibration.measured_impacts"),
    shell:
        "dragchain step record {input:q} --fall-time {params.fall_time} --out {output} 2>&1 | tee -i {log}"


rule sweep_drops:
    input:
        calibration_inputs(),
        of_study("calibration", "record.json"),
    output:
        of_study("calibration", "sweep/drops.json"),
    log:
        of_study("calibration", "logs/sweep.log"),
    benchmark:
        of_study("calibration", "benchmarks/sweep.tsv")
    conda:
        "../envs/python.yaml"
    resources:
        prints=1,
    params:
        study=STUDY,
        fidelity=fidelity_option,
        source=source_hash("dragdeck.campaigns.restitution_drops"),
    shell:
        "dragdeck step drops {params.study} sweep {params.fidelity}"
        " --out $(dirname {output}) 2>&1 | tee -i {log}"


rule fit_restitution:
    input:
        record=drop_record,
        drops=of_study("calibration", "sweep/drops.json"),
    output:
        result=of_study("calibration", "result.json"),
        impacts=of_study("calibration", "impacts.csv"),
        bias=of_study("calibration", "bias.csv"),
    log:
        of_study("calibration", "logs/fit.log"),
    benchmark:
        of_study("calibration", "benchmarks/fit.tsv")
    conda:
        "../envs/python.yaml"
    resources:
        prints=1,
    params:
        source=source_hash("dragchain.calibration.results"),
    shell:
        "dragchain step calibrate {input.record:q} --drops {input.drops}"
        " --out $(dirname {output.result}) 2>&1 | tee -i {log}"


rule confirm_restitution:
    input:
        calibration_inputs(),
        fit=of_study("calibration", "result.json"),
    output:
        of_study("calibration", "confirm/drops.json"),
    log:
        of_study("calibration", "logs/confirm.log"),
    benchmark:
        of_study("calibration", "benchmarks/confirm.tsv")
    conda:
        "../envs/python.yaml"
    resources:
        prints=1,
    params:
        study=STUDY,
        fidelity=fidelity_option,
        source=source_hash("dragdeck.campaigns.restitution_drops"),
    shell:
        "dragdeck step drops {params.study} confirm {params.fidelity} --fit {input.fit}"
        " --out $(dirname {output}) 2>&1 | tee -i {log}"


rule write_calibration_report:
    input:
        rules.fit_restitution.output,
        of_study("calibration", "sweep/drops.json"),
        of_study("calibration", "confirm/drops.json"),
        record=drop_record,
        templates=page_templates("calibration/calibration.html.j2"),
    output:
        page=report(
            of_study("calibration", "report.html"),
            caption="../report/calibration.rst",
            category="Calibration",
            labels={"run": "drop test", "figure": "report"},
        ),
        figures=[
            of_study("calibration", f"figures/{name}.png") for name in ("impacts", "fit", "bias")
        ],
    log:
        of_study("calibration", "logs/report.log"),
    benchmark:
        of_study("calibration", "benchmarks/report.tsv")
    conda:
        "../envs/python.yaml"
    resources:
        prints=1,
    params:
        source=source_hash("dragchain.calibration.report"),
    shell:
        "dragchain step calibration-report {input.record:q} $(dirname {output.page}) 2>&1 | tee -i {log}"
