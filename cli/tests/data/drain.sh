# Takes one from the first reading.
while read -r line; do
  id=$(printf '%s' "$line" | sed 's/.*"id":\([0-9]*\).*/\1/')
  left=$(printf '%s' "$line" | sed 's/.*"value":\([0-9]*\).*/\1/')
  echo "{\"id\":$id,\"value\":[$((left - 1))]}"
done
