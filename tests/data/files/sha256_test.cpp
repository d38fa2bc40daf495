#include "data/files/sha256.h"

#include <gtest/gtest.h>

namespace flash::data {
namespace {

// FIPS 180-4's own examples; a million letters cross many blocks, 55 and 56 bytes the border of the padding.
TEST(Sha256, GivesThePublishedDigests) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, IsTheSameWithTheProcessorsInstructionsAndWithout) {
  if (!has_sha256_instructions()) GTEST_SKIP() << "this processor has none";
  std::string bytes;
  for (int length = 0; length < 300; ++length) {
    EXPECT_EQ(sha256(bytes, true), sha256(bytes, false)) << length;
    bytes += static_cast<char>(37 * length + 11);
  }
}

}  // namespace
}  // namespace flash::data
