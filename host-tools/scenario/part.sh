# Identifies every 500th recording of list.txt that has no line yet, from the one of this number on: sh part.sh NUMBER.
sed -n "$1~500p" list.txt | while read -r log; do
    [ -e "results/$(basename "$log" .log).csv" ] || sh one.sh "$log" < /dev/null
done
true # a recording that is refused has its line
