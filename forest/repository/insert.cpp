// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/insert.h"

#include <iterator>

#include <fmt/format.h>

namespace forest::repository {

using soci::use;

std::string hexadecimal(const std::string& bytes) {
  constexpr char digits[] = "0123456789abcdef";
  std::string text(2 * bytes.size(), '0');
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto byte = static_cast<unsigned char>(bytes[i]);
    text[2 * i] = digits[byte >> 4], text[2 * i + 1] = digits[byte & 15];
  }
  return text;
}

std::string from_hexadecimal(const std::string& text) {
  const auto digit = [](char c) { return c <= '9' ? c - '0' : (c | 32) - 'a' + 10; };
  std::string bytes(text.size() / 2, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = char(digit(text[2 * i]) << 4 | digit(text[2 * i + 1]));
  return bytes;
}

// ── One row ──

void RowInsert::add(const char* column, const char* expression) {
  const char* comma = columns_.empty() ? "" : ", ";
  columns_ += comma, columns_ += column;
  values_ += comma;
  values_ += expression ? fmt::format(fmt::runtime(expression), column) : fmt::format(":{}", column);
}

RowInsert& RowInsert::with(const char* column, int& value, soci::indicator* filled) {
  add(column);
  exchanges_.push_back([&value, filled](soci::statement& s) {
    filled ? s.exchange(use(value, *filled)) : s.exchange(use(value));
  });
  return *this;
}

RowInsert& RowInsert::with(const char* column, long long& value, soci::indicator* filled) {
  add(column);
  exchanges_.push_back([&value, filled](soci::statement& s) {
    filled ? s.exchange(use(value, *filled)) : s.exchange(use(value));
  });
  return *this;
}

RowInsert& RowInsert::with(const char* column, double& value) {
  add(column);
  exchanges_.push_back([&value](soci::statement& s) { s.exchange(use(value)); });
  return *this;
}

RowInsert& RowInsert::with(const char* column, std::string& value, soci::indicator* filled) {
  add(column);
  exchanges_.push_back([&value, filled](soci::statement& s) {
    filled ? s.exchange(use(value, *filled)) : s.exchange(use(value));
  });
  return *this;
}

RowInsert& RowInsert::with_bytes(const char* column, const std::string& bytes) {
  Bytes& b = bytes_.emplace_back();
  b.value = &bytes;
  if (database_->as_text()) {
    add(column, "decode(:{}, 'hex')");
    exchanges_.push_back([&b](soci::statement& s) { s.exchange(use(b.text, b.filled)); });
  } else {
    add(column);
    b.blob = std::make_unique<soci::blob>(database_->sql());
    exchanges_.push_back([&b](soci::statement& s) { s.exchange(use(*b.blob, b.filled)); });
  }
  return *this;
}

void RowInsert::prepare() {
  statement_ = std::make_unique<soci::statement>(database_->sql());
  for (const auto& exchange : exchanges_) exchange(*statement_);
  statement_->alloc();
  statement_->prepare(
      fmt::format("insert into {} ({}) values ({}) on conflict do nothing", table_, columns_, values_));
  statement_->define_and_bind();
}

bool RowInsert::run() {
  for (Bytes& b : bytes_) {
    b.filled = b.value->empty() ? soci::i_null : soci::i_ok;
    if (b.blob) {
      b.blob->trim(0);
      if (!b.value->empty()) b.blob->append(b.value->data(), b.value->size());
    } else {
      b.text = hexadecimal(*b.value);
    }
  }
  if (!statement_) prepare();
  statement_->execute(true);
  return statement_->get_affected_rows() == 1;
}

// ── Many rows ──

RowsInsert& RowsInsert::with(const char* column, Ints& values, std::vector<soci::indicator>* filled) {
  columns_.push_back({column, &values, filled});
  return *this;
}
RowsInsert& RowsInsert::with(const char* column, Reals& values) {
  columns_.push_back({column, &values});
  return *this;
}
RowsInsert& RowsInsert::with(const char* column, Texts& values) {
  columns_.push_back({column, &values});
  return *this;
}

namespace {

void append(std::string& array, int value) { fmt::format_to(std::back_inserter(array), "{}", value); }
void append(std::string& array, double value) { fmt::format_to(std::back_inserter(array), "{}", value); }
void append(std::string& array, const std::string& value) {
  array += '"';
  for (const char c : value) {
    if (c == '"' || c == '\\') array += '\\';
    array += c;
  }
  array += '"';
}

}  // namespace

void RowsInsert::prepare() {
  std::string names, values;
  for (const Column& c : columns_) {
    constexpr const char* types[] = {"int[]", "float8[]", "text[]"};
    const char* comma = names.empty() ? "" : ", ";
    names += comma, names += c.name;
    values += database_->as_text() ? fmt::format("{}cast(:{} as {})", comma, c.name, types[c.values.index()])
                                   : fmt::format("{}:{}", comma, c.name);
  }
  statement_ = std::make_unique<soci::statement>(database_->sql());
  for (Column& c : columns_) {
    if (database_->as_text())
      statement_->exchange(use(c.text));
    else if (c.filled)
      statement_->exchange(use(*std::get<Ints*>(c.values), *c.filled));
    else
      std::visit([&](auto* v) { statement_->exchange(use(*v)); }, c.values);
  }
  statement_->alloc();
  statement_->prepare(database_->as_text()
                          ? fmt::format("insert into {} ({}) select * from unnest({})", table_, names, values)
                          : fmt::format("insert into {} ({}) values ({})", table_, names, values));
  statement_->define_and_bind();
}

void RowsInsert::run(std::size_t count) {
  if (count == 0) return;
  if (database_->as_text())
    for (Column& c : columns_) {
      c.text = "{";
      std::visit(
          [&](const auto* values) {
            for (std::size_t i = 0; i < count; ++i) {
              if (i) c.text += ',';
              if (c.filled && (*c.filled)[i] == soci::i_null)
                c.text += "NULL";
              else
                append(c.text, (*values)[i]);
            }
          },
          c.values);
      c.text += '}';
    }
  if (!statement_) prepare();
  statement_->execute(true);
}

}  // namespace forest::repository
