#pragma once
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "stats/core/error.h"

namespace taihu {

/// Expect that `call` throws an Error of this kind whose message holds `part`.
template <class Call>
void expect_error(Fault fault, const std::string& part, Call&& call) {
    try {
        call();
        ADD_FAILURE() << "no exception; expected one with '" << part << "'";
    } catch (const Error& e) {
        EXPECT_EQ(e.fault(), fault) << e.what();
        EXPECT_THAT(e.what(), testing::HasSubstr(part));
        EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    }
}

} // namespace taihu
