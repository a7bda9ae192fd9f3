"""Parameter files mean the same to `fly`, which reads them itself, and to rclpy: held against rclpy."""

import pytest
import rclpy
import yaml

from quad_core.parameter_files import overrides_for

ORDERS = {
    "named last": [{"/**": {"a": 1, "b": 1}, "/**/recorder": {"a": 2}}],
    "wildcard last": [{"/**/recorder": {"a": 2}, "/**": {"a": 1, "b": 1}}],
    "a later file": [{"/one/recorder": {"a": 2}}, {"/one/recorder": {"a": 3}, "/two/recorder": {"a": 4}}],
    "a later file, an earlier section": [{"/**": {"a": 1, "b": 1}, "/one/recorder": {"a": 2}}, {"/**": {"a": 5}}],
    "a later file, a section of its own": [{"/one/recorder": {"a": 2, "b": 1}}, {"/**": {"a": 5}}],
}


@pytest.mark.parametrize("name", ORDERS)
def test_of_several_sections_and_files_the_same_one_wins_as_in_rclpy(name, tmp_path):
    arguments = ["--ros-args", "-r", "__ns:=/one"]
    for number, content in enumerate(ORDERS[name]):
        path = tmp_path / f"{number}.yaml"
        path.write_text(
            yaml.safe_dump({key: {"ros__parameters": rows} for key, rows in content.items()}, sort_keys=False)
        )
        arguments += ["--params-file", str(path)]
    context = rclpy.Context()
    rclpy.init(args=arguments, context=context)
    node = rclpy.create_node("recorder", context=context, automatically_declare_parameters_from_overrides=True)
    found = {key: node.get_parameter(key).value for key in "ab" if node.has_parameter(key)}
    node.destroy_node()
    context.shutdown()
    assert overrides_for(ORDERS[name], "recorder", "/one") == found
