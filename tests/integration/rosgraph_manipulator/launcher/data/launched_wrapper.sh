#!/bin/sh
# A script that makes way for a node.
export LAUNCHED_BY_WRAPPER=yes
exec "$(dirname "$0")/launched_node.py" "$@"
