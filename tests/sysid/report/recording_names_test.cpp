#include "sysid/report/recording_names.h"

#include <gtest/gtest.h>

#include <set>

namespace flash::sysid {
namespace {

using Names = std::vector<std::string>;

TEST(RecordingNames, AreToldApart) {
  EXPECT_EQ(told_apart({"lift", "drag"}), (Names{"lift", "drag"}));
  EXPECT_EQ(told_apart({"lift", "lift", "lift"}), (Names{"lift", "lift_2", "lift_3"}));
  EXPECT_EQ(told_apart({"lift", "lift", "lift_2"}), (Names{"lift", "lift_3", "lift_2"}));
}

TEST(RecordingNames, FilesStayInTheirFolderAndApart) {
  EXPECT_EQ(file_names({"lift_a", "../../victim", "/etc/passwd", "..", ".", ""}),
            (Names{"lift_a", "_._.._victim", "_etc_passwd", "__", "_", "__2"}));
  EXPECT_EQ(file_names({"</script>", "a\\b", "tab\t"}), (Names{"__script_", "a_b", "tab_"}));
  EXPECT_EQ(file_names({"Lift", "lift"}), (Names{"Lift", "lift_2"}));  // where case does not count
  EXPECT_EQ(file_names({"a/b", "a_b"}), (Names{"a_b", "a_b_2"}));
  const std::string letters = "\xc3\xa4\xc3\xb6\xc3\xbc";
  EXPECT_EQ(file_names({letters}), Names{letters});
}

TEST(RecordingNames, LongNamesAreCutBetweenLetters) {
  std::string text(79, 'a');
  text += "\xc3\xa4";
  const Names files = file_names({std::string(5000, 'x'), std::string(5000, 'x') + "y", text});
  EXPECT_EQ(files[0], std::string(80, 'x'));
  EXPECT_EQ(files[1], std::string(80, 'x') + "_2");
  EXPECT_EQ(files[2], std::string(79, 'a'));
}

}  // namespace
}  // namespace flash::sysid
