# Identifies one recording, in results: sh one.sh recordings/NAME.log. NAME is unlike that of any other recording.
name=$(basename "$1" .log)
exec flexid identify --config edge.toml "$1" --json "results/$name.json" --summary "results/$name.csv" > "results/$name.txt" 2>&1
