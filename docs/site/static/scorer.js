// How the results of a search are ordered: pages for users first, and by how many of the words a heading has.
// A result is [docname, title, anchor, description, score, file name, kind]; the best heading of a page becomes its anchor.

const FIRST = ["docs/how-to/", "docs/errors", "docs/checks", "docs/commands", "docs/configuration", "docs/glossary", "README"];
const LAST = ["docs/decisions/", "docs/names", "CHANGELOG", "CONTRIBUTING", "docs/protocol", "docs/results", "firmware_host/"];
const HEADING = 12; // for each of the words that stands in a heading
const OWN_TITLE = 8; // more, if that is the page's title
const ANOTHER_NAME = -45; // for a name of the program that the query does not write in full: "stop" is no world.arm.fieldbus.stop
const SHORT_HEADING = 3; // more, the larger the share of these words in the heading
const SAYS = ["no", "not", "without"]; // of the words that a search leaves out
const PREFIX = 4; // letters, from which on the beginning of a word is enough: "servo" finds the servomotor

var Scorer = {
  score: (result) => {
    const [page, title, , , score] = result;
    if (result[6] === "object" && !isNamed(title)) return score + ANOTHER_NAME;
    const rank = FIRST.some((start) => page.startsWith(start)) ? 6 : LAST.some((start) => page.startsWith(start)) ? -6 : 0;
    const { count, share, heading, anchor } = bestHeading(page, title);
    if (count && result[6] === "text") {
      if (anchor) [result[1], result[2]] = [`${title} > ${heading}`, `#${anchor}`];
      return score + rank + HEADING * count + SHORT_HEADING * share + (anchor ? 0 : OWN_TITLE);
    }
    return score + rank + (page === "docs/checks" ? 1 : 0); // before an error of the same name
  },
  objNameMatch: 60, // the name of an error, a check, a key or a command, written in full
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};

/** Return the words of the query, cut to their stems, without those that say nothing. */
function wantedStems() {
  const query = new URLSearchParams(window.location.search).get("q") ?? "";
  return stemsOf(query);
}

function stemsOf(text) {
  const stemmer = new Stemmer();
  const words = text.toLowerCase().split(/[^\p{L}\p{N}_]+/u).filter((word) => word && (SAYS.includes(word) || !stopwords.has(word)));
  return new Set(words.map((word) => stemmer.stemWord(word)));
}

/** Return whether the query is this name: all its words, or a word that only a name can be, as payload_kg. */
function isNamed(name) {
  const [wanted, own] = [wantedStems(), stemsOf(name)];
  const named = [...wanted].filter((stem) => own.has(stem));
  return named.some((stem) => stem.includes("_")) || (named.length === wanted.size && wanted.size === own.size);
}

/** Return the heading of a page with most of the words: their count and share, the heading, and its anchor (null for the page's own). */
function bestHeading(page, title) {
  const number = Search._index.docnames.indexOf(page);
  const wanted = wantedStems();
  let best = { count: 0, share: 0, heading: title, anchor: null };
  for (const [heading, places] of Object.entries(Search._index.alltitles))
    for (const [file, anchor] of places) {
      if (file !== number) continue;
      const stems = stemsOf(heading);
      const begins = (stem) => stem.length >= PREFIX && [...stems].some((whole) => whole.startsWith(stem));
      const count = [...wanted].filter((stem) => stems.has(stem) || begins(stem)).length;
      if (count > best.count || (count === best.count && count && anchor === null))
        best = { count, share: count / stems.size, heading, anchor };
    }
  return best;
}
