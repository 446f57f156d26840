#include "config/yaml_reader.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <map>
#include <set>
#include <sstream>

#include "config/text.h"

namespace arex::config_detail {
namespace {

constexpr std::size_t kDeepest = 32;         // nested lists and maps
constexpr std::size_t kMostNodes = 100'000;  // values, what aliases repeat counted each time
constexpr std::size_t kLongestKey = 200;

std::size_t count_nodes(const ConfigNode& node) {
  std::size_t count = 1;
  for (const auto& entry : node.entries) count += count_nodes(entry.value);
  for (const auto& item : node.items) count += count_nodes(item);
  return count;
}

/// Builds the nodes out of the parser's events: nothing is built that has not been counted.
class NodeBuilder : public YAML::EventHandler {
 public:
  NodeBuilder(const std::string& name, Positions positions) : name_(name), positions_(positions) {}

  [[nodiscard]] std::string position(const YAML::Mark& mark) const {
    if (positions_ == Positions::kName) return name_;
    return name_ + ":" + std::to_string(mark.is_null() ? 1 : mark.line + 1);
  }
  ConfigNode take() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (begun_) fail(position(mark), "a second document begins, expected one");
    begun_ = true;
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (expects_key()) fail(position(mark), "a key is missing before the ':'");
    ConfigNode node = make(ConfigNode::Kind::kNull, mark);
    // yaml-cpp places an absent value on the next line.
    if (!open_.empty() && open_.back().node.kind == ConfigNode::Kind::kMap) {
      node.where = open_.back().key_where;
    }
    add(std::move(node), anchor);
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    if (expects_key()) fail(position(mark), "an alias stands for a key, expected a plain word");
    const auto named = anchored_.find(anchor);
    if (named == anchored_.end()) {
      fail(position(mark), "an alias stands inside of what it names, expected it behind that");
    }
    count(count_nodes(named->second), mark);
    add(named->second, 0);
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    reject_tag(tag, mark);
    ConfigNode node = make(ConfigNode::Kind::kScalar, mark);
    node.scalar = value;
    if (expects_key()) {
      take_key(value, mark);
      if (anchor != 0) anchored_[anchor] = std::move(node);
    } else {
      add(std::move(node), anchor);
    }
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    open(ConfigNode::Kind::kSequence, mark, tag, anchor);
  }
  void OnSequenceEnd() override { close(); }

  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    open(ConfigNode::Kind::kMap, mark, tag, anchor);
  }
  void OnMapEnd() override { close(); }

 private:
  /// A list or map whose end has not come yet.
  struct Open {
    ConfigNode node;
    YAML::anchor_t anchor = 0;
    bool has_key = false;  ///< of a map: the next value's key has been read
    std::string key, key_where;
    std::set<std::string> keys;
  };

  [[nodiscard]] bool expects_key() const {
    return !open_.empty() && open_.back().node.kind == ConfigNode::Kind::kMap &&
           !open_.back().has_key;
  }

  void count(std::size_t nodes, const YAML::Mark& mark) {
    nodes_ += nodes;
    if (nodes_ > kMostNodes) {
      fail(position(mark),
           "more than " + std::to_string(kMostNodes) + " values, aliases followed; expected fewer");
    }
  }

  ConfigNode make(ConfigNode::Kind kind, const YAML::Mark& mark) {
    count(1, mark);
    ConfigNode node;
    node.kind = kind;
    node.where = position(mark);
    return node;
  }

  void reject_tag(const std::string& tag, const YAML::Mark& mark) const {
    // What yaml-cpp says of a value without a tag: '?', quoted '!'.
    if (tag.empty() || tag == "?" || tag == "!") return;
    fail(position(mark), "has the tag '" + shortened(tag) + "', expected none");
  }

  void take_key(const std::string& key, const YAML::Mark& mark) {
    Open& map = open_.back();
    const std::string where = position(mark);
    if (key == "<<") fail(where, "a merge key '<<', expected the keys themselves");
    if (key.size() > kLongestKey) fail(where, "unknown key '" + shortened(key) + "'");
    if (!map.keys.insert(key).second) {
      fail(where, "duplicate key '" + shortened(key) + "', expected each key once");
    }
    map.key = key;
    map.key_where = where;
    map.has_key = true;
  }

  void open(ConfigNode::Kind kind, const YAML::Mark& mark, const std::string& tag,
            YAML::anchor_t anchor) {
    reject_tag(tag, mark);
    if (expects_key()) {
      fail(position(mark), "a key must be a plain word (or a bracket is not closed)");
    }
    if (open_.size() == kDeepest) {
      fail(position(mark), "nested deeper than " + std::to_string(kDeepest) + " levels");
    }
    Open container;
    container.node = make(kind, mark);
    container.anchor = anchor;
    open_.push_back(std::move(container));
  }

  void close() {
    Open container = std::move(open_.back());
    open_.pop_back();
    add(std::move(container.node), container.anchor);
  }

  void add(ConfigNode node, YAML::anchor_t anchor) {
    if (anchor != 0) {
      count(count_nodes(node), {});
      anchored_[anchor] = node;
    }
    if (open_.empty()) {
      root_ = std::move(node);
    } else if (Open& parent = open_.back(); parent.node.kind == ConfigNode::Kind::kMap) {
      parent.node.entries.push_back({parent.key, parent.key_where, std::move(node)});
      parent.has_key = false;
    } else {
      parent.node.items.push_back(std::move(node));
    }
  }

  const std::string& name_;
  Positions positions_;
  bool begun_ = false;
  std::size_t nodes_ = 0;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, ConfigNode> anchored_;
  ConfigNode root_;
};

/// Without the byte order mark and with '\n' at the ends of its lines.
/// @throws ConfigError for what is no text.
std::string checked_text(const std::string& raw, const std::string& name, Positions positions) {
  std::string text;
  text.reserve(raw.size());
  int line = 1;
  for (std::size_t at = raw.starts_with("\xef\xbb\xbf") ? 3 : 0; at < raw.size();) {
    const std::size_t begin = at;
    const std::optional<char32_t> point = take_utf8(raw, at);
    if (point == U'\r' && at < raw.size() && raw[at] == '\n') continue;
    const bool control = point && ((*point < 0x20 && *point != '\n' && *point != '\t') ||
                                   *point == 0x7f || (*point >= 0x80 && *point < 0xa0));
    if (!point || control) {
      const std::string where =
          positions == Positions::kName ? name : name + ":" + std::to_string(line);
      const std::string byte = printable(raw.substr(begin, point ? at - begin : 1));
      fail(where, (point ? "control character " : "no UTF-8: byte ") + byte +
                      ", expected a text of UTF-8");
    }
    if (point == U'\n') ++line;
    text.append(raw, begin, at - begin);
  }
  return text;
}

}  // namespace

ConfigNode read_yaml(const std::string& text, const std::string& name, Positions positions) {
  NodeBuilder builder(name, positions);
  if (text.size() > kLongestYaml) {
    fail(builder.position({}), "longer than " + std::to_string(kLongestYaml) + " bytes");
  }
  std::istringstream stream(checked_text(text, name, positions));
  try {
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const YAML::Exception& error) {
    fail(builder.position(error.mark), "not valid YAML: " + error.msg);
  }
  return builder.take();
}

}  // namespace arex::config_detail
