// What the studies of the tick share: their options, what a tick takes, and what a tool presses on.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/error.h"
#include "runtime/body/body.h"
#include "runtime/core/tick/state.h"
#include "runtime/core/touch/contact_nodes.h"

namespace palpate::test {

/// What stands between commas.
inline std::vector<std::string> words_of(const std::string& text) {
  std::vector<std::string> found;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    found.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return found;
}

inline double number(const std::string& text) {
  return std::strtod(text.c_str(), nullptr);
}

/// Numbers between commas.
inline std::vector<double> numbers(const std::string& text) {
  std::vector<double> found;
  for (const std::string& word : words_of(text)) found.push_back(number(word));
  return found;
}

/// X,Y,Z; throws Error for anything else.
inline Vec3 vector(const std::string& text) {
  const std::vector<double> parts = numbers(text);
  if (parts.size() != 3) throw Error("is not X,Y,Z", text, "give three numbers");
  return {parts[0], parts[1], parts[2]};
}

/// Gives the options of a command line, which has a body's file first, to those who take them; that file.
/// Throws Error where there is none, or for an option that nobody takes.
inline std::string read_options(int count, char** words,
                                const std::map<std::string, std::function<void(const std::string&)>>& known) {
  if (count < 2) throw Error("no body is given", "", "give a BODY.palpate.hdf first");
  for (int k = 2; k < count; k += 2) {
    const auto option = known.find(words[k]);
    if (option == known.end() || k + 1 == count)
      throw Error("is no option with a value", words[k], "see the head of the study's source");
    option->second(words[k + 1]);
  }
  return words[1];
}

/// Processor time of this thread [s].
inline double processor_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Surface nodes that closed contact points press on, each once.
inline Index pressed_nodes(const Body& body, const State& state) {
  std::vector<Index> nodes;
  for (const ContactPoint& contact : state.contacts()) {
    if (!contact.force.isZero(0.0))
      for_each_node(body, state.surface.near, contact, [&](Index node, double) { nodes.push_back(node); });
  }
  std::ranges::sort(nodes);
  return static_cast<Index>(std::unique(nodes.begin(), nodes.end()) - nodes.begin());
}

}  // namespace palpate::test
