#!/bin/sh
# Print the first of NAME, NAME-2, NAME-3, ... that does not exist or is an empty folder. Nothing is ever removed.
folder=$1
n=1
while [ -e "$folder" ] && [ -n "$(ls -A "$folder" 2> /dev/null || echo unreadable)" ]; do
    n=$((n + 1))
    folder=$1-$n
done
echo "$folder"
