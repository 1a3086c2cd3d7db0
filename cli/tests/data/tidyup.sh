# Answers the modules of a room to be tidied: drives take longer between rooms, one arm reaches the table, and what is
# put down stands on its surface.
while read -r line; do
  id=${line#*'"id":'}
  id=${id%%,*}
  case "$line" in
    *'"kind":"cost"'*'room1'*'room2'*|*'"kind":"cost"'*'room2'*'room1'*) value=40 ;;
    *'"kind":"cost"'*) value=10 ;;
    *'"kind":"effect"'*) value='[1.2, 0.4, 0.75, 0, 0, 0, 1]' ;;
    *) value=true ;;
  esac
  echo "{\"id\":$id,\"value\":$value}"
done
