// Kinds of state that firmware in C++ keeps: `what=…`. Each counts its trials: 1 wherever all is set back.
#include "standstill.h"

#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {
std::vector<int> vector;
std::vector<int> filled(100, 7);
std::string text("a text that is too long to stand in the string itself");
std::map<std::string, int> map;

int in_a_static()
{
    static std::vector<int> inside;
    inside.push_back(1);
    return static_cast<int>(inside.size());
}

template <typename T> struct Counter {
    static int calls;
};
template <typename T> int Counter<T>::calls = 0;

int caught()
{
    static int before = 0;
    try {
        throw std::runtime_error("inside of the library");
    } catch (const std::exception &) {
        before++;
    }
    return before;
}

int count_of(const std::string &what)
{
    if (what == "vector") {
        filled.resize(filled.size() + 1000);
        vector.push_back(1);
        return filled.size() == 1100 ? static_cast<int>(vector.size()) : 9;
    }
    if (what == "string") {
        bool same = text.size() == 53;
        for (int k = 0; k < 500; k++) {
            text += " and longer";
        }
        return same ? 1 : 2;
    }
    if (what == "map") {
        return ++map["a key that is too long to stand in the string itself"];
    }
    if (what == "static") {
        return in_a_static();
    }
    if (what == "template") {
        return ++Counter<long>::calls;
    }
    if (what == "caught") {
        return caught();
    }
    if (what == "stream") {
        std::ostringstream out;
        out << 0.5 << ' ' << 3;
        return out.str() == "0.5 3" ? 1 : 2;
    }
    if (what == "throw") {
        throw std::runtime_error("out of the library");
    }
    return 0;
}

int count;

void *create(const sts_drive *, const char *config, uint64_t, const char **refused)
{
    std::string lines(config);
    std::string what = lines.substr(5, lines.find('\n') - 5);
    *refused = "no such state";
    count = what == "throw-later" ? -1 : count_of(what);
    return count == 0 ? nullptr : &count;
}

int32_t isr(void *, const sts_readings *, sts_legs *, sts_result *result)
{
    if (count < 0) {
        throw std::runtime_error("out of the library");
    }
    result->angle = 0.1f * static_cast<float>(count);
    return STS_FOUND;
}
} // namespace

extern "C" const sts_detector *sts_entry(uint32_t)
{
    static const sts_detector detector = {
        STS_ABI, sizeof detector, STS_INTERRUPT, 12500, 0.0f, 1, "states", create, nullptr, nullptr, nullptr, isr,
    };
    return &detector;
}
