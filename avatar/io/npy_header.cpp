#include "avatar/io/npy_header.h"

#include "avatar/io/npy.h"

namespace avatar {
namespace {

class HeaderParser {
 public:
  explicit HeaderParser(std::string_view text) : text_(text) {}

  NpyHeader parse() {
    NpyHeader header;
    int found = 0;
    expect('{');
    while (!accept('}')) {
      const std::string key = quoted();
      expect(':');
      if (key == "descr") {
        header.descr = description();
      } else if (key == "fortran_order") {
        header.fortranOrder = boolean();
      } else if (key == "shape") {
        header.shape = tuple();
      } else {
        fail("has the unknown entry '" + key + "'");
      }
      ++found;
      if (!accept(',')) {
        expect('}');
        break;
      }
    }
    if (found != 3 || header.descr.empty()) {
      fail("must have exactly descr, fortran_order and shape");
    }
    return header;
  }

 private:
  [[noreturn]] static void fail(const std::string& problem) {
    throw NpyFormatError("the array header " + problem + "; write the file again with numpy.savez");
  }

  void skipSpaces() {
    while (position_ < text_.size() && (text_[position_] == ' ' || text_[position_] == '\n')) {
      ++position_;
    }
  }

  char peek() {
    skipSpaces();
    return position_ < text_.size() ? text_[position_] : '\0';
  }

  bool accept(char wanted) {
    const bool matches = peek() == wanted;
    position_ += matches ? 1 : 0;
    return matches;
  }

  void expect(char wanted) {
    if (!accept(wanted)) {
      fail(std::string("is damaged (expected '") + wanted + "')");
    }
  }

  std::string quoted() {
    const char quote = peek();
    if (quote != '\'' && quote != '"') {
      fail("is damaged (expected a quoted name)");
    }
    const std::size_t end = text_.find(quote, position_ + 1);
    if (end == std::string_view::npos) {
      fail("is damaged (a quote is not closed)");
    }
    std::string result(text_.substr(position_ + 1, end - position_ - 1));
    position_ = end + 1;
    return result;
  }

  std::string description() {
    if (peek() == '[') {
      throw NpyFormatError("structured arrays aren't supported; save each field as its own array");
    }
    return quoted();
  }

  bool boolean() {
    skipSpaces();
    for (const std::string_view word : {"True", "False"}) {
      if (text_.substr(position_).starts_with(word)) {
        position_ += word.size();
        return word == "True";
      }
    }
    fail("is damaged (expected True or False)");
  }

  std::vector<std::int64_t> tuple() {
    // numpy itself allows 32 axes.
    constexpr std::size_t kMaxAxes = 32;
    std::vector<std::int64_t> extents;
    expect('(');
    while (!accept(')')) {
      extents.push_back(integer());
      if (extents.size() > kMaxAxes) {
        fail("has more than 32 axes");
      }
      if (!accept(',')) {
        expect(')');
        break;
      }
    }
    return extents;
  }

  std::int64_t integer() {
    std::int64_t value = 0;
    const char first = peek();
    if (first < '0' || first > '9') {
      fail("is damaged (expected an extent ≥ 0)");
    }
    while (position_ < text_.size() && text_[position_] >= '0' && text_[position_] <= '9') {
      if (__builtin_mul_overflow(value, 10, &value) ||
          __builtin_add_overflow(value, text_[position_] - '0', &value)) {
        fail("has an extent that is too large");
      }
      ++position_;
    }
    accept('L');  // Python 2 wrote long integers as 3L.
    return value;
  }

  std::string_view text_;
  std::size_t position_ = 0;
};

}  // namespace

NpyHeader parseNpyHeader(std::string_view text) {
  return HeaderParser(text).parse();
}

}  // namespace avatar
