#include "data/picture/html_page.h"

#include <gtest/gtest.h>

namespace flash::data {
namespace {

TEST(HtmlPage, Base64IsThatOfRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string_view("\xff\xfe\x00", 3)), "//4A");
}

TEST(HtmlPage, KeysAreReplacedOnceAndValuesAreNotReadAgain) {
  EXPECT_EQ(fill_page("<@A@|@B@|@A@>", {{"@A@", "@B@"}, {"@B@", "2"}}), "<@B@|2|@A@>");
}

TEST(HtmlPage, NoTextEndsTheScriptElement) {
  EXPECT_EQ(inside_script(R"({"a": "</script></b>"})"), R"({"a": "\u003c/script>\u003c/b>"})");
  EXPECT_EQ(inside_script(R"({"a": "<!--<script>"})"), R"({"a": "\u003c!--\u003cscript>"})");
}

}  // namespace
}  // namespace flash::data
