"""Prints the command line of the launch file, with replacements of `launch` and `launch_ros` that compose it as
launch_ros does: options, then --ros-args with the node's name, namespace and parameter files.

launch_file.py NAME:=VALUE ...
"""

import pathlib
import runpy
import shlex
import sys
import types


class Recorded:
    def __init__(self, *positional, **named):
        self.positional, self.named = positional, named


class Argument(Recorded):
    pass


class Function(Recorded):
    pass


class Node(Recorded):
    def command(self):
        named = dict(self.named)
        words = [named.pop("executable"), *named.pop("arguments"), "--ros-args", "-r", f"__node:={named.pop('name')}"]
        if namespace := named.pop("namespace"):
            words += ["-r", f"__ns:={namespace if namespace.startswith('/') else '/' + namespace}"]
        for file in named.pop("parameters"):
            words += ["--params-file", file]
        assert set(named) == {"output", "sigterm_timeout", "sigkill_timeout"}, named
        assert all(isinstance(word, str) for word in [*words, *named.values()]), words
        return words


def main():
    given = dict(argument.split(":=", 1) for argument in sys.argv[1:])

    class Configuration:
        def __init__(self, name):
            self.name = name

        def perform(self, _):
            return given[self.name]

    def module(name, **content):
        sys.modules[name] = types.ModuleType(name)
        vars(sys.modules[name]).update(content)

    module("launch", LaunchDescription=Recorded)
    module("launch.actions", DeclareLaunchArgument=Argument, OpaqueFunction=Function)
    module("launch.substitutions", LaunchConfiguration=Configuration)
    module("launch_ros")
    module("launch_ros.actions", Node=Node)
    file = pathlib.Path(__file__).parent.parent / "launch/voxtile.launch.py"
    (actions,) = runpy.run_path(str(file))["generate_launch_description"]().positional
    declared = {action.positional[0]: action.named for action in actions if isinstance(action, Argument)}
    assert set(given) <= set(declared), declared
    for name, named in declared.items():
        assert named["description"] and (named["default_value"] is not None or name in given), name
        given.setdefault(name, named["default_value"])
    (function,) = [action for action in actions if isinstance(action, Function)]
    (node,) = function.named["function"](None)
    print(shlex.join(node.command()[1:]))


if __name__ == "__main__":
    main()
