#!/bin/bash
# Captive tests of {{ craft }}, one to a task. Line n of {{ runs }} is the run of task n.
#SBATCH --job-name={{ name }}
#SBATCH --array=1-{{ tasks }}{% if at_once %}%{{ at_once }}{% endif %}

#SBATCH --nodes=1
#SBATCH --ntasks={{ cpus }}
#SBATCH --output={{ folder }}/task-%a.log
#SBATCH --open-mode=append
{% for name, value in options %}
#SBATCH --{{ name }}={{ value }}
{% endfor %}
{% for option in extra %}
#SBATCH {{ option }}
{% endfor %}
{% if modules %}
module load {{ modules | join(" ") }}
{% endif %}
{% for line in lines %}
{{ line }}
{% endfor %}
cd {{ study }}
run=$(sed -n "${SLURM_ARRAY_TASK_ID}p" {{ runs }})
exec {{ python }} -m towtank solve-case "$run" --cores {{ cpus }} --out .
