#!/bin/sh
# All figures of docs/performance.md on an idle machine, in one go: some 40 minutes.
# Runs from the root of the sources: sh benchmarks/all.sh
set -e
results=benchmarks/results
python benchmarks/whole.py --out "$results/bench.json"
python benchmarks/peers.py --out "$results/peers.json"
python benchmarks/growth.py --out "$results/growth.json"
python benchmarks/tables.py
# not filled in: the table of irregular rails and the cost of a study
python benchmarks/irregular.py --repeats 3 --out "${TMPDIR:-/tmp}/irregular.json"
python benchmarks/study_cost.py "${TMPDIR:-/tmp}/study_cost"
