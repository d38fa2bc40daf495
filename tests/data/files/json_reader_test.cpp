#include "data/files/json_reader.h"

#include <gtest/gtest.h>

#include "data/files/text.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

TEST(JsonReader, NearestNameIsTheOneMeant) {
  const std::vector<std::string> known = {"young", "poisson", "bending", "yaw_rad", "thickness"};
  EXPECT_EQ(nearest_name("poison", known), "poisson");
  EXPECT_EQ(nearest_name("Young", known), "young");
  EXPECT_EQ(nearest_name("yaw", known), "yaw_rad");
  EXPECT_EQ(nearest_name("thikness", known), "thickness");
  EXPECT_EQ(nearest_name("colour", known), "");
}

TEST(JsonReader, MessagesNameFileFieldFoundAndExpected) {
  const nlohmann::json json = parse_json(
      R"({"a": {"b": [{"n": "x", "v": [1, 2], "i": 1.5, "z": null, "d": [0, 0, 0], "big": 1E+10}]}})",
      "f.json");
  const JsonObject file(json, "f.json");
  const JsonObject b = file.object("a").objects("b").at(0);
  EXPECT_EQ(input_error_of([&] { b.number("n"); }), "f.json: a.b[0].n: found \"x\", expected a number");
  EXPECT_EQ(input_error_of([&] { b.number("m"); }), "f.json: a.b[0].m: missing, expected a number");
  EXPECT_EQ(input_error_of([&] { b.vector("v", 3); }),
            "f.json: a.b[0].v: found [1,2], expected a list of 3 numbers");
  EXPECT_EQ(input_error_of([&] { b.integer("i"); }), "f.json: a.b[0].i: found 1.5, expected a whole number");
  EXPECT_EQ(input_error_of([&] { b.direction("d", {}); }),
            "f.json: a.b[0].d: found [0,0,0], expected a direction that is not zero");
  EXPECT_EQ(input_error_of([&] { b.object("v"); }),
            "f.json: a.b[0].v: found [1,2], expected an object {...}");
  EXPECT_EQ(input_error_of([&] { file.objects("a"); }).substr(0, 17), "f.json: a: found ");
  EXPECT_EQ(input_error_of([&] { JsonObject(b.raw("v"), "f.json"); }),
            "f.json: found [1,2], expected an object {...}");
  EXPECT_EQ(b.number("big"), 1e10);
  EXPECT_FALSE(b.has("z"));
  EXPECT_EQ(b.number("z", 7.0), 7.0);
}

TEST(JsonReader, SyntaxErrorsNameLineAndColumn) {
  EXPECT_NE(input_error_of([] {
              parse_json("{\n  \"a\": 1,\n}", "f.json");
            }).find("f.json: not valid JSON: line 3, column 1"),
            std::string::npos);
  EXPECT_EQ(input_error_of([] { parse_json("{\"a\": 1e999}", "f.json"); }),
            "f.json: not valid JSON: a number is too large");
  for (const char* text : {"", " \n"})
    EXPECT_EQ(input_error_of([&] { parse_json(text, "f.json"); }), "f.json: not valid JSON: it is empty");
  EXPECT_EQ(input_error_of([] { parse_json("{", "f.json"); }),
            "f.json: not valid JSON: line 1, column 2: it ends within a value");
  EXPECT_EQ(input_error_of([] { parse_json("{\"a\": x}", "f.json"); }),
            "f.json: not valid JSON: line 1, column 7: found x, which nothing before it allows");
}

TEST(JsonReader, ByteOrderMarksAreReadOrNamed) {
  EXPECT_EQ(parse_json("\xef\xbb\xbf{\"a\": 1}", "a.json")["a"], 1);
  EXPECT_EQ(input_error_of([] { parse_json(std::string("\xff\xfe{\0", 4), "a.json"); }),
            "a.json: found text in UTF-16, expected UTF-8: save it so");
}

TEST(JsonReader, DeepNestingIsRefusedBeforeTheStackEnds) {
  const auto nested = [](std::size_t levels) {
    return R"({"text": "[[[[\"[", "list":)" + std::string(levels, '[') + std::string(levels, ']') + '}';
  };
  EXPECT_EQ(input_error_of([&] { parse_json(nested(255), "f.json"); }), "");
  EXPECT_EQ(input_error_of([&] { parse_json(nested(256), "f.json"); }),
            "f.json: line 1: found more than 256 levels of nesting");
  EXPECT_NE(input_error_of([&] { parse_json(nested(80000), "f.json"); }), "");
  EXPECT_NE(input_error_of([&] { parse_json(std::string(80000, '['), "f.json"); }), "");
}

TEST(JsonReader, NamesGivenTwiceInOneObjectAreRefused) {
  const auto message = [](const char* text) { return input_error_of([&] { parse_json(text, "f.json"); }); };
  EXPECT_EQ(message(R"({"props": {"young": 1, "poisson": 0.3, "young": 2}})"),
            "f.json: props.young: given twice, expected once");
  EXPECT_EQ(message(R"({"a": 1, "b": [{"a": 1}, {"a": 2}], "c": {"a": {}}, "a": null})"),
            "f.json: a: given twice, expected once");
  EXPECT_EQ(message(R"({"a": {"a": 1}, "b": [{"a": 1}, {"a": 2}]})"), "");
}

TEST(JsonReader, FormattedTextReadsBackAsTheSame) {
  nlohmann::ordered_json value = {
      {"text", "a, b: \"c\" \\"}, {"numbers", {1.5, 1e-7, 3}}, {"nothing", nullptr}};
  for (int i = 0; i < 30; ++i) value["list"].push_back({{"t", 0.1 * i}, {"cloud", "frames/000.ply"}});
  const std::string text = format_json(value);
  EXPECT_EQ(nlohmann::ordered_json::parse(text), value);
  EXPECT_NE(text.find("\"text\": \"a, b: \\\"c\\\" \\\\\""), std::string::npos) << text;
  std::size_t longest = 0;
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) longest = std::max(longest, line.size());
  EXPECT_LE(longest, 120u);
}

TEST(Text, NumbersAreReadWholeAndWithoutLocale) {
  EXPECT_EQ(parse_number("1E+10"), 1e10);
  EXPECT_EQ(parse_number("+1.5"), 1.5);
  EXPECT_EQ(parse_number("1.5x"), std::nullopt);
  EXPECT_EQ(parse_number(""), std::nullopt);
  EXPECT_EQ(parse_number("+-1"), std::nullopt);
  EXPECT_EQ(parse_integer("12"), 12);
  EXPECT_EQ(parse_integer("1.5"), std::nullopt);
  for (const double value : {0.1, 1e-300, -2.0 / 3, 1e10})
    EXPECT_EQ(parse_number(format_number(value)), value);
  EXPECT_EQ(format_count(2113), "2,113");
  EXPECT_EQ(format_count(1000000), "1,000,000");
  EXPECT_EQ(format_count(999), "999");
  EXPECT_EQ(to_index(3), 3);
  EXPECT_EQ(to_index(-1), -1);
  EXPECT_EQ(to_index(0.5), -1);
  EXPECT_EQ(to_index(4294967296.0), -1);
}

}  // namespace
}  // namespace flash::data
