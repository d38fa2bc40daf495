#pragma once
#include <string>
#include <vector>

#include "sysid/emulate/grid_results.h"

namespace flash::sysid {

/// Names of the columns of the tables in the folder of a search. The last of results.csv is `digest`.
std::vector<std::string> results_columns(const std::vector<Axis>& axes);
std::vector<std::string> registrations_columns();
std::vector<std::string> keyframes_columns();

/// What the tables say of one candidate: its line in results.csv without the digest, and its lines in the
/// other two, each with its end.
struct CandidateLines {
  std::string result, registrations, keyframes;
};

/// `recordings`: names of those that the result has.
CandidateLines lines_of(const CandidateResult& result, const std::vector<std::string>& recordings);

/// What binds the lines of a candidate to each other and to their search: the first 16 hexadecimal digits of
/// a SHA-256 over `search` (search_digest) and the lines. It tells what was exchanged or edited by mistake;
/// who computes it anew can write what he likes.
std::string digest_of(const CandidateLines& lines, const std::string& search);

/// The same of all candidates of a search: over their digests, in order of id.
std::string digest_of(const GridResults& results);

}  // namespace flash::sysid
