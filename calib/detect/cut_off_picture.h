#pragma once
#include <string_view>

namespace flash::calib {

/// Whether a JPEG ends before its end marker (ISO/IEC 10918-1, annex B): decoders fill what is missing with
/// grey and say nothing. False of any other file, and of a JPEG with more behind its end.
bool is_cut_off_jpeg(std::string_view file);

/// Whether a BMP has fewer bytes than its header says the rows of its picture take, which decoders fill
/// likewise. Of packed ones, whose length no header tells, false.
bool is_cut_off_bmp(std::string_view file);

}  // namespace flash::calib
