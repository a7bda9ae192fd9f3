# The stack on ROS 2 Jazzy: docker build -t quad_stack . && docker run --rm quad_stack
FROM ros:jazzy
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
WORKDIR /ws
COPY . src/quad_stack
# rosdep installs what the package files name; pip may write, for the image holds nothing else
ENV PIP_BREAK_SYSTEM_PACKAGES=1
RUN apt-get update \
    && rosdep update --rosdistro jazzy \
    && rosdep install --from-paths src --ignore-src --rosdistro jazzy -y \
    && rm -rf /var/lib/apt/lists/* \
    && . /opt/ros/jazzy/setup.bash \
    && colcon build --packages-up-to quad_bringup \
    && printf 'source /ws/install/setup.bash\nexec "$@"\n' >/with_workspace.sh
VOLUME /ws/flights
ENTRYPOINT ["/bin/bash", "/with_workspace.sh"]
CMD ["ros2", "launch", "quad_bringup", "flight.launch.py", "case:=case2"]
