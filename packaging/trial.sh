#!/usr/bin/env bash
# trial.sh FOLDER: install the Debian packages of a folder on a bare Debian 12, and try them as a user without a checkout.
# It installs packages and adds a user, so run it as root in a system that can be thrown away. CONTRIBUTING.md says how.
set -euo pipefail

folder=$(realpath "${1:?which folder has the packages?}")
visitor=mros-visitor

say() { printf '\ntrial: %s\n' "$*" >&2; }
fail() { say "FAILED: $*"; exit 1; }

[[ $EUID -eq 0 ]] || fail "run it as root in a system that can be thrown away"
[[ -n $(compgen -G "$folder/mros-python_*.deb") ]] || fail "$folder has no packages: make them with ./mros package"

# remove_all: remove what this or an earlier trial has installed.
remove_all() {
  local installed
  mapfile -t installed < <(dpkg-query -W -f='${db:Status-Abbrev} ${Package}\n' 'mros*' 2>/dev/null | sed -n 's/^ii *//p')
  [[ ${#installed[@]} -eq 0 ]] || apt-get purge -y "${installed[@]}" >/dev/null
  userdel --remove "$visitor" >/dev/null 2>&1 || true
}

export DEBIAN_FRONTEND=noninteractive
remove_all

say "installing the meta-controller without the demonstrator"
apt-get update >/dev/null
generic=()
for file in "$folder"/*.deb; do
  case $(dpkg-deb -f "$file" Package) in
    mros-demo | mros-move-base | mros-metacontrol-sim | mros-metacontrol-experiments | mros-pybullet-simulator | mros-simulator-msgs | \
    mros-control-msgs | mros-metacontrol-manipulation) ;;
    *) generic+=("$file") ;;
  esac
done
apt-get install -y --no-install-recommends "${generic[@]}" >/dev/null
useradd --create-home "$visitor"

# as_visitor SCRIPT: run it as a user whose environment knows nothing of ROS, and who may not write to /usr.
as_visitor() {
  su --login --shell /bin/bash "$visitor" -c "set -euo pipefail; $1"
}

say "models, nodes and commands of the meta-controller"
as_visitor 'rospack find rosgraph_monitor; rosmodel --help >/dev/null; rosrun mros1_reasoner explain --help >/dev/null
  rosrun rosgraph_manipulator plan --help >/dev/null; rosrun rosgraph_monitor watch --help >/dev/null'
if as_visitor 'rospack find move_base' >/dev/null 2>&1; then fail "the meta-controller brings a move_base along"; fi

say "installing the demonstrator"
apt-get install -y --no-install-recommends "$folder"/*.deb >/dev/null

say "models of the demonstrator"
as_visitor 'rosmodel check /usr/share/metacontrol_sim/models'

say "a mission in lockstep: the laser dies, the robot arrives on its camera"
as_visitor 'metacontrol run --engine lockstep --quiet --route r1 --failure-at 0.4 --output lockstep
  grep -q "\"goal_reached\": true" lockstep/summary.json'

say "the same on ROS, with all nodes"
as_visitor 'metacontrol run --quiet --route r1 --failure-at 0.4 --output ros
  grep "\"goal_reached\"\|\"final_configuration\"\|\"reconfigurations\"" ros/summary.json
  grep -q "\"goal_reached\": true" ros/summary.json; grep -q "\"final_configuration\": \".*_k\"" ros/summary.json'

say "a package of one's own: a running robot is modelled, and its meta-controller deploys it"
cat >"/home/$visitor/own.sh" <<'OWN'
set -euo pipefail
export ROS_MASTER_URI=http://localhost:$1 ROS_HOSTNAME=localhost
trap 'kill -INT $(jobs -p) 2>/dev/null; wait' EXIT

# wait_for TEXT COMMAND...: until the command's output has the text, for two minutes at most.
wait_for() {
  local text=$1 deadline=$((SECONDS + 120)); shift
  until "$@" 2>/dev/null | grep -q "$text"; do
    [[ $SECONDS -lt $deadline ]] || { echo "not within two minutes: $text in: $*" >&2; exit 1; }
    sleep 1
  done
}

roslaunch -p "$1" metacontrol_sim robot.launch >robot.log 2>&1 &
wait_for /front/scan rostopic list
mkdir -p own/src && cd own/src
catkin_create_pkg my_robot rosgraph_monitor >/dev/null && cd my_robot
export ROS_PACKAGE_PATH=${PWD%/*}
rosmodel snapshot -o models/
rosmodel init models/snapshot.rossystem
rosmodel generate all models/ -o .
roslaunch mros1_reasoner metacontrol.launch project:="$PWD" initial_configuration:=snapshot_default >~/metacontrol.log 2>&1 &
wait_for STABLE timeout 10 rostopic echo -n 1 /rosgraph_manipulator/active_configuration
wait_for /reasoner rosnode list
OWN
as_visitor 'bash own.sh 11399'

say "removing all of it"
remove_all
for left in /usr/lib/mros /usr/share/metacontrol_sim /usr/lib/move_base /usr/lib/python3/dist-packages/move_base; do
  [[ ! -e $left ]] || fail "$left is left"
done
say "passed"
