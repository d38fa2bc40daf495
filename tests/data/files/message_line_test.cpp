#include "data/files/message_line.h"

#include <gtest/gtest.h>

namespace flash::data {
namespace {

TEST(MessageLine, WhatFitsStaysButForControlCharacters) {
  EXPECT_EQ(message_line("a.json: young:  found \"stiff\"\n\x7f"), "a.json: young:  found \"stiff\"??");
  const std::string path(399, 'p');  // a word of 400 bytes with its colon
  EXPECT_EQ(message_line(path + ": missing"), path + ": missing");
  EXPECT_EQ(message_line(""), "");
  EXPECT_EQ(message_line(" a  "), " a  ");
}

TEST(MessageLine, LongWordsAndLinesLoseTheirMiddle) {
  const std::string line =
      message_line("file: " + std::string(2500, 'a') + std::string(2500, 'z') + ": unknown");
  EXPECT_EQ(line.size(), 6 + 266 + 3 + 100 + std::string(" unknown").size());
  EXPECT_EQ(line.substr(0, 10), "file: aaaa");
  EXPECT_EQ(line.substr(line.size() - 12), "zzz: unknown");
  std::string words = "first";
  for (int k = 0; k < 5000; ++k) words += " word";
  const std::string cut = message_line(words + " last");
  EXPECT_LE(cut.size(), 2000u);
  EXPECT_TRUE(cut.starts_with("first word") && cut.ends_with("word last")) << cut;
}

TEST(MessageLine, BytesThatAreNoLettersBecomeQuestionMarks) {
  EXPECT_EQ(message_line("a\xff"
                         "b \xc3\xa9 \xc3 \xe2\x82"),
            "a?b \xc3\xa9 ? ??");
  EXPECT_EQ(message_line("\x80\xc0\xaf"), "???");
}

TEST(MessageLine, NoLetterIsCutInTwo) {
  for (std::size_t shift = 0; shift < 3; ++shift) {
    std::string name(shift, 'x');
    for (int k = 0; k < 1000; ++k) name += "\xe2\x82\xac";  // three bytes
    const std::string line = message_line(name);
    for (std::size_t i = shift; i < line.size();) {
      if (line.compare(i, 3, "...") != 0) {
        ASSERT_EQ(line.substr(i, 3), "\xe2\x82\xac") << shift << " at " << i;
      }
      i += 3;
    }
  }
}

}  // namespace
}  // namespace flash::data
