#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The architecture check refuses what it must: each test breaks one rule in a copy of forest/."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = pathlib.Path(__file__).resolve().parent


class CheckLayers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.project = pathlib.Path(folder.name)
        shutil.copytree(HERE.parent / "forest", self.project / "forest")

    def append(self, file, line):
        with (self.project / "forest" / file).open("a") as text:
            text.write(f"{line}\n")

    def check(self):
        return subprocess.run([sys.executable, HERE / "check_layers.py", self.project], capture_output=True, text=True)

    def assert_refused(self, *words):
        result = self.check()
        self.assertEqual(result.returncode, 1)
        for word in words:
            self.assertIn(word, result.stderr)

    def test_the_project_itself_passes(self):
        result = self.check()
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_an_include_that_goes_up_is_refused(self):
        lines = (self.project / "forest/core/error.cpp").read_text().count("\n")
        self.append("core/error.cpp", '#include "forest/morphology/morphology.h"')
        self.assert_refused(f"error.cpp:{lines + 1}:", "core may not include morphology")

    def test_an_include_of_an_undeclared_neighbour_is_refused(self):
        self.append("geometry/polyline.h", '#include "forest/statistics/metric.h"')
        self.assert_refused("polyline.h", "geometry may not include statistics")

    def test_an_include_of_an_application_is_refused(self):
        self.append("morphology/morphology.cpp", '#include "apps/cli/console.h"')
        self.assert_refused("morphology.cpp", "apps/cli/console.h")

    def test_an_include_relative_to_the_folder_is_refused(self):
        self.append("core/error.cpp", '#include "../morphology/morphology.h"')
        self.assert_refused("error.cpp", "from the root")

    def test_a_source_whose_header_does_not_come_first_is_refused(self):
        source = self.project / "forest/core/error.cpp"
        source.write_text("#include <vector>\n" + source.read_text())
        self.assert_refused("error.cpp:1:", "include forest/core/error.h first")

    def test_a_second_type_of_one_name_is_refused(self):
        self.append("statistics/two_samples.h", "namespace forest::statistics {\nstruct Metric {\n};\n}")
        self.assert_refused("forest::statistics::Metric is another type in", "name them apart")

    def test_a_library_in_a_header_that_others_include_is_refused(self):
        self.append("core/vec.h", "#include <hdf5.h>")
        self.assert_refused("vec.h brings <hdf5.h>", "private to core")

    def test_a_library_that_comes_through_a_second_header_is_refused(self):
        self.append("core/error.h", "#include <sqlite3.h>")
        self.append("core/vec.h", '#include "forest/core/error.h"')
        self.assert_refused("vec.h brings <sqlite3.h>")

    def test_a_library_that_the_room_does_not_name_is_refused(self):
        self.append("scene/cut.cpp", "#include <epoxy/gl.h>")
        self.assert_refused("cut.cpp", "<epoxy/gl.h>", "EPOXY")

    def test_a_library_of_another_room_is_refused_in_tests_too(self):
        self.append("morphology/morphology_test.cpp", "#include <nlohmann/json.hpp>")
        self.assert_refused("morphology_test.cpp", "nlohmann_json::")

    def test_a_test_library_outside_tests_is_refused(self):
        self.append("core/error.cpp", "#include <gtest/gtest.h>")
        self.assert_refused("error.cpp", "<gtest/gtest.h>")

    def test_an_unknown_library_is_refused(self):
        self.append("core/error.cpp", "#include <git2.h>")
        self.assert_refused("error.cpp", "no known library", "LIBRARIES")

    def test_a_library_that_is_named_no_more_is_refused(self):
        lists = self.project / "forest/scene/CMakeLists.txt"
        lists.write_text(lists.read_text().replace("nlohmann_json::nlohmann_json", ""))
        self.assert_refused("view.cpp", "<nlohmann/json.hpp>")

    def test_a_cycle_of_rooms_is_refused(self):
        lists = self.project / "forest/core/CMakeLists.txt"
        lists.write_text("forest_module(DEPENDS morphology)\n")
        self.assert_refused("cycle", "core -> ", "morphology")

    def test_a_dependency_on_no_room_is_refused(self):
        lists = self.project / "forest/core/CMakeLists.txt"
        lists.write_text("forest_module(DEPENDS nowhere)\n")
        self.assert_refused("nowhere, which is no room")


if __name__ == "__main__":
    unittest.main()
