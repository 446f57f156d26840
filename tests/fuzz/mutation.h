#pragma once

#include <string>
#include <vector>

#include "math/random.h"

/// Damage to texts and binary files, a pure function of the random stream.
namespace arex::test {

/// One or a few of: bits flipped, bytes lost, doubled, moved or made up, the end cut off, a piece
/// of another file put in.
std::string damage_bytes(std::string bytes, const std::vector<std::string>& others,
                         RandomStream& random);

/// Damage that leaves most of the YAML in place: a value replaced by one that is hostile to
/// numbers, texts or lists, a key renamed, doubled or moved under another one, a line that has a
/// meaning of its own (alias, tag, merge key, document, control character) put in.
std::string damage_yaml(std::string text, const std::vector<std::string>& others,
                        RandomStream& random);

/// A value that somebody may give to a parameter.
std::string hostile_value(RandomStream& random);

}  // namespace arex::test
