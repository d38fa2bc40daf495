#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace flash::sim {

/// Scenes in a folder of their own, with the asset cloth.json beside them: a sheet of 0.1 m, 0.2 kg/m^2.
class SceneRunTest : public testing::Test {
 protected:
  SceneRunTest()
      : folder_(
            std::filesystem::temp_directory_path() /
            ("flash_scene_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    write("cloth.json",
          R"({"schema": "flash-asset/1", "mesh": "sheet:0.1x0.1:0.02", "element_type": "TRIANGLE",
      "mechanical_props": {"constitutive": "TRI_COROTATED", "areal_density": 0.2, "young": 100, "poisson": 0.3, "bending_rigidity": 1e-5,
      "friction": 0.3}})");
  }
  ~SceneRunTest() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  std::string out() const { return (folder_ / "out").string(); }

  // The named column of a CSV as text, one entry a row.
  std::vector<std::string> column(const std::string& file, const std::string& name) const {
    std::ifstream in(std::filesystem::path(out()) / file);
    std::vector<std::string> values;
    std::size_t index = 0;
    for (std::string line; std::getline(in, line);) {
      std::vector<std::string> words;
      std::istringstream stream(line);
      for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
      if (values.empty()) index = std::find(words.begin(), words.end(), name) - words.begin();
      values.push_back(words.at(index));
    }
    values.erase(values.begin());
    return values;
  }

  std::filesystem::path folder_;
};

}  // namespace flash::sim
