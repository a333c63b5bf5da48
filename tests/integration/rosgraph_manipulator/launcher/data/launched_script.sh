#!/bin/bash
# A script that is no ROS node at all.
echo "script $1 in $PWD with $LAUNCHED_FILE and $ROS_NAMESPACE"
while true; do sleep 0.1; done
