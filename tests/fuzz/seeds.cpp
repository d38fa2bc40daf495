#include <cstdio>

#include "tests/fuzz/good_files.h"

int main(int count, char** arguments) {
  if (count != 2) {
    std::fputs("usage: fuzz_seeds FOLDER\n", stderr);
    return 2;
  }
  flash::fuzz::write_good_files(arguments[1]);
}
