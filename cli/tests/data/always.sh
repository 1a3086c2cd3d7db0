# Answers every question with the one value that it is given.
while read -r line; do
  id=${line#*'"id":'}
  echo "{\"id\":${id%%,*},\"value\":$1}"
done
