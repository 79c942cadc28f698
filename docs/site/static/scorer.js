// How the results of a search are ordered: pages for users first, and by how many of the words a heading has.
// A result is [docname, title, anchor, description, score, file name, kind]; the best heading of a page becomes its anchor.

const FIRST = ["docs/how-to/", "docs/errors", "docs/checks", "docs/commands", "docs/configuration", "docs/glossary", "README"];
const LAST = ["docs/decisions/", "docs/names", "CHANGELOG", "CONTRIBUTING", "docs/protocol", "docs/results", "firmware_host/"];
const HEADING = 12; // for each of the words that stands in a heading
const OWN_TITLE = 8; // more, if that is the page's title

var Scorer = {
  score: (result) => {
    const [page, title, , , score] = result;
    const rank = FIRST.some((start) => page.startsWith(start)) ? 6 : LAST.some((start) => page.startsWith(start)) ? -6 : 0;
    const { count, heading, anchor } = bestHeading(page, title);
    if (count && result[6] === "text") {
      if (anchor) [result[1], result[2]] = [`${title} > ${heading}`, `#${anchor}`];
      return score + rank + HEADING * count + (anchor ? 0 : OWN_TITLE);
    }
    return score + rank;
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
  const words = text.toLowerCase().split(/[^\p{L}\p{N}_]+/u).filter((word) => word && !stopwords.has(word));
  return new Set(words.map((word) => stemmer.stemWord(word)));
}

/** Return the heading of a page with most of the words: their count, the heading, and its anchor (null for the page's own). */
function bestHeading(page, title) {
  const number = Search._index.docnames.indexOf(page);
  const wanted = wantedStems();
  let best = { count: 0, heading: title, anchor: null };
  for (const [heading, places] of Object.entries(Search._index.alltitles))
    for (const [file, anchor] of places) {
      if (file !== number) continue;
      const stems = stemsOf(heading);
      const count = [...wanted].filter((stem) => stems.has(stem)).length;
      if (count > best.count || (count === best.count && count && anchor === null)) best = { count, heading, anchor };
    }
  return best;
}
