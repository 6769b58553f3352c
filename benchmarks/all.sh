#!/bin/sh
# All figures of docs/performance.md on an idle machine, in one go: some 40 minutes.
# Runs from the root of the sources: sh benchmarks/all.sh
set -e
results=benchmarks/results
python benchmarks/whole.py --out "$results/bench.json"
python benchmarks/peers.py --out "$results/peers.json"
python benchmarks/growth.py --out "$results/growth.json"
python benchmarks/irregular.py --repeats 3 --out "$results/speeds.json"
python benchmarks/versions.py --out "$results/versions.json"
python benchmarks/study_cost.py "${TMPDIR:-/tmp}/study_cost" --json "$results/study.json"
python benchmarks/study_cost.py "${TMPDIR:-/tmp}/study_files" --frictions 8 --keep all --json "$results/study_files.json"
rm -r "${TMPDIR:-/tmp}/study_cost" "${TMPDIR:-/tmp}/study_files"
python benchmarks/tables.py
